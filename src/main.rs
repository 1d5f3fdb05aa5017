fn main() {
    for a in caustica::gpu::adapters() {
        println!("{} {} {} {:?}", a.name, a.driver, a.kind, a.unusable);
    }
    let _gpu = caustica::gpu::Gpu::open(None).unwrap();
}
