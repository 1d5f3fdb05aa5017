//! Structs shared with the GPU have the same fields at the same offsets on both sides, and shared
//! constants the same values. The shaders are reflected with naga and compared with `src/layout/`.

use std::{any::type_name, fs, io, mem::offset_of};

use caustica::{gpu::shaders::SHADERS, layout};
use naga::{AddressSpace, ArraySize, Expression, Handle, Literal, Module, ScalarKind, Type, TypeInner};

/// Name, byte offset and Rust type of a field.
type Field = (String, u32, String);

/// A struct of `src/layout/`.
struct Twin {
    name: &'static str,
    size: u32,
    fields: Vec<Field>,
}

/// Describes structs of `src/layout/`. A missing field is a compile error.
macro_rules! twins {
    ($($name:ident { $($field:ident),+ $(,)? })+) => {
        vec![$({
            fn type_of<F>(_: impl Fn(layout::$name) -> F) -> String {
                type_name::<F>().replace("caustica::layout::", "")
            }
            let _all = |layout::$name { $($field: _),+ }: layout::$name| ();
            Twin {
                name: stringify!($name),
                size: size_of::<layout::$name>() as u32,
                fields: vec![$((
                    stringify!($field).to_string(),
                    offset_of!(layout::$name, $field) as u32,
                    type_of(|value| value.$field),
                )),+],
            }
        }),+]
    };
}

fn twins() -> Vec<Twin> {
    twins! {
        BvhNode { grid, low, high }
        Primitive { v0, material, e1, id, e2, emitter }
        Instance { to_scene, from_scene_x, first, from_scene_y, stored, from_scene_z, root }
        Normals { n0, n1, n2, attributes }
        MaterialRecord { color, kind, emission, ior, roughness, metallic, transmission, flags, f0, specular, normal_scale, opacity, cutoff, diffuse_transmission, diffuse_transmission_color, clearcoat, clearcoat_roughness, clearcoat_normal_scale, anisotropy, anisotropy_rotation, sheen_color, sheen_roughness, iridescence, iridescence_ior, iridescence_thickness, first_texture, textures, pad }
        TextureRecord { first, size, flags, levels, transform }
        Attributes { uvs, colors, tangents, pad }
        Medium { tint, ior, absorption, dispersion }
        Light { position, kind, e1, named, e2, solid_angle, emission, area, media, back_media, material, attributes, subtriangle, side, leaf, root, clearcoat, pad }
        LightNode { center, half, shine }
        LightChoice { cdf, probability }
        SceneSphere { center, radius }
        Target { center, radius, share, parallel_share, pad0, pad1 }
        EnvironmentInfo { columns, rows, rotation_cos, rotation_sin }
        Path { origin, history, direction, bounces, beta, left, media }
        Photon { position, wi, flux, normal }
        VisiblePoint { position, next_map, weight, offset, ng, media_low, ns, media_high, view, above }
        LobePoint { position, offset, beta, eta, ng, ns, view, tangent, f0, f90, compensation, sheen, alpha, clearcoat, clearcoat_normal, pad }
        Counters { current, next, staged, lost, rays, rays_high, media_overflows, unfinished, non_finite, lost_high, shadow_rays, reads, further_rays }
        PhotonBatch { seed, first_round, first_round_high, paths, light_count, strata, first_stratum, max_bounces, rules, staging_capacity, lost_scale, stream, first_target, target_count, max_surfaces, least_kept, aim, kept_scale, entry_count, pad0, pad1 }
        Store { staged, first_photon, photons, kind }
        CameraTile { position, seed, right, width, up, height, forward, spp, first_column, first_row, first_sample, samples, gathers, branches, pixels, parallel, lens_radius, focus, filter_steps, margin, media, near_depth, far_depth, start_depth, cells_from, listed, listed_at, left_out, shift, square_bits, patches, other_light, merges_layers, lobe_patches, sharp_glass, gathers_coats, pad2 }
        FinalStep { first_ray, rays_now, rays, chosen, seed, for_records, pad1, pad2 }
        BrightPatch { position, radius, normal, power, tangent, narrow }
        CellGrid { per_metre, levels, mask, points, next_map, pad0, pad1, pad2 }
        ArrivingLight { red, green, blue, fluence, nearness, coat }
        IrradianceRecord { position, ng, irradiance, reach, coat, coat_reach }
        LightDirections { red, green, blue, open_reach }
        RecordGrid { first_column, first_row, columns, rows, columns_per_pixel, rows_per_pixel, reach, footprint }
        IrradianceCell { coordinates, level, position, split, normal, narrow, irradiance, pad }
        FirstHit { normal, depth, albedo, alpha, position, id, uv, instance, material }
        DirectLight { light, pad0, pad1, pad2 }
        EmitterSample { sample, samples, roots, pad }
        Cell { lo, wi_lo, hi, wi_hi }
        PhotonPosition { position, wi }
        PhotonFlux { flux, normal }
        MapInfo { count, levels, split, pad }
        GatherInfo { count, first, neighbors, fixed_radius, max_radius_squared, per_path, stride, kernel_mean, kernel, kernel_fifth, map_number, pad0, pad1 }
        Gathered { radius_squared, count, fingerprint, narrow }
        ShareRound { cells, cell_pixels, samples, candidates, step, margin, branches, reach_squared, points, map_number, is_listed }
        SortStep { count, shift, stride, pad }
        BoundStep { count, first_box }
        KeyStep { count, segment_first, segment_count, fine }
        MoveStep { sorted_first, sorted_count, segment_first, segment_count }
        GridStep { photons, level, base, finer_base, finer_count, first_cell, cell_count, pad }
    }
}

macro_rules! constants {
    ($($name:ident),+ $(,)?) => { [$((stringify!($name), layout::$name as f64)),+] };
}

fn constants() -> Vec<(&'static str, f64)> {
    constants![
        WORKGROUP_SIZE,
        BVH_INDEX_BITS,
        BVH_STACK,
        INSTANCED_STACK,
        TREE_HEIGHTS,
        LATE_HEADER,
        LATE_SLICE,
        LATE_RAY,
        LATE_WORDS,
        MAX_NORMAL_WEIGHT,
        OFFSET_SCALE,
        MEDIA_WORDS,
        SLOT_SHIFT,
        SLOT_MASK,
        NO_SLOT,
        SHARP_ROUGHNESS,
        METAL,
        MATERIAL_MASK,
        NOTHING_LEFT,
        CHAIN_LIMIT,
        MOST_VEILS,
        NO_MATERIAL,
        LOST_SCALE,
        MARGIN_CELL,
        MARGIN_SAMPLES,
        SPHERE_BIT,
        TRANSMITS_BIT,
        CONTACT_BIT,
        RANK_SHIFT,
        MAX_RANK,
        ID_MASK,
        ALPHA_BIT,
        DIFFUSE,
        MIRROR,
        GLASS,
        PANE,
        LAYERED,
        MATERIAL_TEXELS,
        ATTRIBUTE_TEXELS,
        INSTANCE,
        INSTANCE_TEXELS,
        DOUBLE_SIDED_BIT,
        MASK_BIT,
        BLEND_BIT,
        UNLIT_BIT,
        SMALL_GLASS_BIT,
        CLEAR_BIT,
        WRAP_REPEAT,
        WRAP_MIRROR,
        WRAP_CLAMP,
        LINEAR_BIT,
        SRGB_BIT,
        SECOND_UV_BIT,
        TEXTURE_ROLE_SHIFT,
        TEXTURE_TEXELS,
        BASE_COLOR_TEXTURE,
        METALLIC_ROUGHNESS_TEXTURE,
        NORMAL_TEXTURE,
        EMISSION_TEXTURE,
        SPECULAR_TEXTURE,
        SPECULAR_COLOR_TEXTURE,
        TRANSMISSION_TEXTURE,
        DIFFUSE_TRANSMISSION_TEXTURE,
        DIFFUSE_TRANSMISSION_COLOR_TEXTURE,
        CLEARCOAT_TEXTURE,
        CLEARCOAT_ROUGHNESS_TEXTURE,
        CLEARCOAT_NORMAL_TEXTURE,
        SHEEN_COLOR_TEXTURE,
        SHEEN_ROUGHNESS_TEXTURE,
        ANISOTROPY_TEXTURE,
        IRIDESCENCE_TEXTURE,
        IRIDESCENCE_THICKNESS_TEXTURE,
        POINT_LIGHT,
        SPOT_LIGHT,
        DIRECTIONAL_LIGHT,
        TRIANGLE_LIGHT,
        SPHERE_LIGHT,
        ENVIRONMENT_LIGHT,
        TURNED_BIT,
        LIGHT_ROOTS,
        SUMMED_ROOT,
        ENVIRONMENT_ROOT,
        EMITTER_ROOT,
        NO_LEAF,
        LEAF_BIT,
        IMPORTANCE_CHILDREN,
        OPENINGS_SIDE,
        BOTH_WAYS_BIT,
        FAR_BIT,
        NEXT_MASK,
        STREAM_PHOTON,
        STREAM_CAUSTIC,
        STREAM_PILOT,
        STORE_GLOBAL,
        STORE_DIRECT,
        STORE_CAUSTIC,
        FOLLOW_DIFFUSE,
        AIM,
        BY_CELL,
        CAUSTICS_APART,
        MAX_PATCHES,
        SEES_GLEAMS,
        NO_LIGHTS_LEFT,
        MAX_TARGETS,
        WHOLE_CELL,
        SPLIT_CELL,
        WIDE_CELL,
        CELL_FLATNESS,
        CELL_COSINE,
        CELL_SURFACES,
        NARROW_COSINE,
        GLOBAL_MAP,
        CAUSTIC_MAP,
        MAP_KINDS,
        PATH_MASK,
        PHOTON_INDEX_SHIFT,
        PHOTON_INDEX_MASK,
        KIND_SHIFT,
        SAMPLER_RANDOM,
        SAMPLER_SOBOL,
        CELL_PHOTONS,
        CELL_FAN,
        RADIX_CHUNK,
        RADIX_DIGITS,
        SCAN_SPAN,
        BOUND_LANES,
        LAYER_ROWS,
        SEARCH_STATE_BYTES,
        GATHER_STATE_BYTES,
        MAX_WORKGROUPS,
        KEY_BITS,
        PACKET_BLOCK,
        QUERY_BLOCK,
        PILOT_STRIDE,
        FIRST_PILOT_STRIDE,
        MAX_RAYS,
        TABLE_COLUMNS
    ]
    .to_vec()
}

/// Structs that only the device writes and reads, and the sizes that the host allocates, bytes.
const OPAQUE: [(&str, usize); 2] =
    [("SearchState", layout::SEARCH_STATE_BYTES), ("GatherState", layout::GATHER_STATE_BYTES)];

fn opaque_bytes(name: Option<&str>) -> Option<u32> {
    OPAQUE.iter().find(|(n, _)| Some(*n) == name).map(|(_, bytes)| *bytes as u32)
}

/// Differences of a kernel from `src/layout/`, one line each.
fn disagreements(wgsl: &str) -> Vec<String> {
    let module = naga::front::wgsl::parse_str(wgsl).expect("composed shaders are valid");
    let mut found = Vec::new();
    for handle in bound_structs(&module) {
        found.extend(compare_struct(&module, handle));
    }
    for (name, value) in named_values(&module) {
        if let Some((_, expected)) = constants().iter().find(|(n, _)| *n == name)
            && value != Some(*expected)
        {
            found.push(format!("{name} is {value:?} in the shader and {expected} in src/layout"));
        }
    }
    for entry in &module.entry_points {
        // A single invocation is launched as such, not through the folded dispatch.
        if ![[layout::WORKGROUP_SIZE, 1, 1], [1, 1, 1]].contains(&entry.workgroup_size) {
            found.push(format!("{} has workgroups of {:?}", entry.name, entry.workgroup_size));
        }
    }
    found
}

/// Structs that kernels decode from the texels of tables.
const IN_TABLES: [&str; 6] = ["Instance", "IrradianceRecord", "LightDirections", "LightNode", "Medium", "Normals"];

/// Records of tables of which kernels read single texels, so that no struct of theirs is one.
const READ_BY_ROWS: [&str; 3] = ["MaterialRecord", "TextureRecord", "Attributes"];

/// Structs in storage or uniform buffers, nested ones included, and structs in tables.
fn bound_structs(module: &Module) -> Vec<Handle<Type>> {
    let in_buffer = |space| matches!(space, AddressSpace::Storage { .. } | AddressSpace::Uniform);
    let mut open: Vec<_> =
        module.global_variables.iter().filter(|(_, v)| in_buffer(v.space)).map(|(_, v)| v.ty).collect();
    let is_in_table = |ty: &Type| ty.name.as_deref().is_some_and(|name| IN_TABLES.contains(&name));
    open.extend(module.types.iter().filter(|(_, ty)| is_in_table(ty)).map(|(handle, _)| handle));
    let mut found = Vec::new();
    while let Some(handle) = open.pop() {
        match &module.types[handle].inner {
            TypeInner::Array { base, .. } => open.push(*base),
            TypeInner::Struct { members, .. } if !found.contains(&handle) => {
                found.push(handle);
                if opaque_bytes(module.types[handle].name.as_deref()).is_none() {
                    open.extend(members.iter().map(|m| m.ty));
                }
            }
            _ => {}
        }
    }
    found
}

fn compare_struct(module: &Module, handle: Handle<Type>) -> Vec<String> {
    let Type { name, inner: TypeInner::Struct { members, span } } = &module.types[handle] else { return Vec::new() };
    if let Some(bytes) = opaque_bytes(name.as_deref()) {
        let line = format!("{name:?} takes {span} bytes in the shader and {bytes} in src/layout");
        return if bytes == *span { Vec::new() } else { vec![line] };
    }
    let name = name.as_deref().unwrap_or("a nameless struct");
    let Some(twin) = twins().into_iter().find(|t| t.name == name) else {
        return vec![format!("{name} lies in a buffer and is not among the twins of this test")];
    };
    let field = |m: &naga::StructMember| (m.name.clone().unwrap_or_default(), m.offset, rust_type(module, m.ty));
    let fields: Vec<Field> = members.iter().map(field).collect();
    let mut found = Vec::new();
    if fields != twin.fields {
        found.push(format!("{name} is {fields:?} in the shader and {:?} in src/layout", twin.fields));
    }
    if *span != twin.size {
        found.push(format!("{name} takes {span} bytes in the shader and {} in src/layout", twin.size));
    }
    found
}

/// The Rust type that holds a WGSL type of a buffer.
fn rust_type(module: &Module, handle: Handle<Type>) -> String {
    let scalar = |s: naga::Scalar| {
        let kind = match s.kind {
            ScalarKind::Float => "f",
            ScalarKind::Uint => "u",
            ScalarKind::Sint => "i",
            _ => "?",
        };
        format!("{kind}{}", s.width * 8)
    };
    match &module.types[handle].inner {
        TypeInner::Scalar(s) | TypeInner::Atomic(s) => scalar(*s),
        TypeInner::Vector { size, scalar: s } => format!("[{}; {}]", scalar(*s), *size as u32),
        TypeInner::Array { base, size: ArraySize::Constant(n), .. } => format!("[{}; {n}]", rust_type(module, *base)),
        TypeInner::Struct { .. } => module.types[handle].name.clone().unwrap_or_default(),
        other => format!("{other:?}"),
    }
}

/// Constants and overrides of the module with their values; `None` where the value is not a literal
/// number.
fn named_values(module: &Module) -> Vec<(String, Option<f64>)> {
    let number = |init: Handle<Expression>| match module.global_expressions[init] {
        Expression::Literal(Literal::U32(n)) => Some(f64::from(n)),
        Expression::Literal(Literal::I32(n)) => Some(f64::from(n)),
        Expression::Literal(Literal::F32(x)) => Some(f64::from(x)),
        Expression::Literal(Literal::AbstractInt(n)) => Some(n as f64),
        _ => None,
    };
    let constants = module.constants.iter().map(|(_, c)| (c.name.clone(), number(c.init)));
    let overrides = module.overrides.iter().map(|(_, o)| (o.name.clone(), o.init.and_then(number)));
    constants.chain(overrides).filter_map(|(name, value)| Some((name?, value))).collect()
}

#[test]
fn shaders_and_host_agree() {
    assert!(!SHADERS.is_empty());
    let lines = |s: &caustica::gpu::shaders::Shader| {
        disagreements(s.wgsl).into_iter().map(|line| format!("{}: {line}", s.stem)).collect::<Vec<_>>()
    };
    let found: Vec<_> = SHADERS.iter().flat_map(lines).collect();
    assert!(found.is_empty(), "{}", found.join("\n"));
}

#[test]
fn this_test_knows_every_struct_and_constant_of_the_host() {
    let files = fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/src/layout")).expect("the folder is there");
    let read = |file: io::Result<fs::DirEntry>| fs::read_to_string(file.expect("listed").path()).expect("it reads");
    let source: String = files.map(read).collect();
    let named = |prefix: &str, end: char| -> Vec<&str> {
        source.lines().filter_map(|l| l.strip_prefix(prefix)?.split_once(end)).map(|(name, _)| name.trim()).collect()
    };
    let (structs, values) = (named("pub struct ", '{'), named("pub const ", ':'));
    assert!(structs.len() > 5 && values.len() > 5, "{structs:?} {values:?}");
    let missing: Vec<_> = structs
        .into_iter()
        .filter(|name| twins().iter().all(|t| t.name != *name))
        .chain(values.into_iter().filter(|name| constants().iter().all(|(n, _)| n != name)))
        .collect();
    assert!(missing.is_empty(), "add to this test: {missing:?}");
}

/// Constants that no kernel names: sizes of structs; values that a kernel reads from a field or
/// infers from the others of their kind; a limit of the host. Their values are not compared.
const NOT_NAMED: [&str; 14] = [
    "MASK_BIT",
    "WRAP_REPEAT",
    "MEDIA_WORDS",
    "SEARCH_STATE_BYTES",
    "GATHER_STATE_BYTES",
    "GLASS",
    "STREAM_PHOTON",
    "STREAM_CAUSTIC",
    "STREAM_PILOT",
    "SAMPLER_SOBOL",
    "MAX_TARGETS",
    "SPLIT_CELL",
    "INSTANCED_STACK",
    "TREE_HEIGHTS",
];

#[test]
fn every_other_constant_of_the_host_stands_in_some_kernel() {
    let in_kernel = |name: &str| SHADERS.iter().any(|s| names_value(s.wgsl, name));
    let is_missing = |name: &&str| !NOT_NAMED.contains(name) && !in_kernel(name);
    let missing: Vec<_> = constants().into_iter().map(|(name, _)| name).filter(is_missing).collect();
    assert!(missing.is_empty(), "no kernel names {missing:?}, so nothing compares their values");
    assert!(names_value(GOOD, "SPHERE_BIT") && !names_value(GOOD, "TRANSMITS_BIT"), "control");
}

fn names_value(wgsl: &str, name: &str) -> bool {
    let module = naga::front::wgsl::parse_str(wgsl).expect("composed shaders are valid");
    named_values(&module).iter().any(|(n, _)| n == name)
}

#[test]
fn every_struct_of_the_host_lies_in_some_kernels_buffer() {
    let bound: Vec<String> = SHADERS.iter().flat_map(|s| bound_names(s.wgsl)).collect();
    let is_unused = |name: &&str| !READ_BY_ROWS.contains(name) && !bound.iter().any(|b| b == name);
    let unused: Vec<_> = twins().into_iter().map(|t| t.name).filter(is_unused).collect();
    assert!(unused.is_empty(), "no kernel binds {unused:?}");
    assert_eq!(bound_names(GOOD), ["Path", "Photon"]);
}

/// Names of the structs that a kernel's buffers hold, sorted.
fn bound_names(wgsl: &str) -> Vec<String> {
    let module = naga::front::wgsl::parse_str(wgsl).expect("composed shaders are valid");
    let mut names: Vec<_> =
        bound_structs(&module).into_iter().filter_map(|handle| module.types[handle].name.clone()).collect();
    names.sort();
    names
}

/// A kernel that agrees with the host.
const GOOD: &str = "
    const WORKGROUP_SIZE: u32 = 64u;
    const SPHERE_BIT = 1u << 31u;
    const PHOTON_INDEX_MASK = 0xfffu;
    struct Photon { position: vec3f, wi: u32, flux: vec3f, normal: u32 }
    struct Path {
        origin: vec3f, history: u32, direction: vec3f, bounces: u32, beta: vec3f, left: u32, media: array<u32, 4>,
    }
    @group(1) @binding(0) var<storage, read> photons: array<Photon>;
    @group(2) @binding(0) var<storage, read_write> paths: array<Path>;
    @compute @workgroup_size(WORKGROUP_SIZE)
    fn probe() { paths[0].history = photons[0].normal | SPHERE_BIT; }
";

#[test]
fn a_kernel_that_agrees_passes() {
    assert_eq!(disagreements(GOOD), Vec::<String>::new());
}

#[test]
fn each_kind_of_disagreement_is_reported() {
    for (from, to, said) in [
        ("position: vec3f, wi: u32, flux: vec3f", "flux: vec3f, wi: u32, position: vec3f", "Photon is"),
        ("wi: u32", "wi: f32", "Photon is"),
        ("flux: vec3f", "flow: vec3f", "Photon is"),
        ("flux: vec3f", "flux: vec4f", "Photon takes"),
        ("media: array<u32, 4>", "media: array<u32, 8>", "Path takes"),
        (", normal: u32 }", ", normal: u32, more: u32 }", "Photon takes"),
        ("SPHERE_BIT = 1u << 31u", "SPHERE_BIT = 1u << 30u", "SPHERE_BIT is"),
        ("= 64u", "= 32u", "WORKGROUP_SIZE is"),
        ("PHOTON_INDEX_MASK = 0xfffu", "PHOTON_INDEX_MASK = 0x7ffu", "PHOTON_INDEX_MASK is"),
        ("@workgroup_size(WORKGROUP_SIZE)", "@workgroup_size(8, 8)", "workgroups of"),
        ("media: array<u32, 4>", "media: array<Stranger, 4>", "Stranger lies in a buffer"),
        ("struct Photon", "@group(2) @binding(1) var<storage> s: array<SearchState>; struct Photon", "SearchState"),
    ] {
        assert!(GOOD.contains(from));
        let bad = format!("struct Stranger {{ a: u32 }} struct SearchState {{ a: u32 }}\n{}", GOOD.replace(from, to));
        let found = disagreements(&bad);
        assert!(found.iter().any(|line| line.contains(said)), "{to}: {found:?}");
    }
}
