//! The `caustica` command.

mod cli;

fn main() -> std::process::ExitCode {
    quiet_driver();
    cli::run()
}

/// Mesa's device-select layer prints errors of its own to stderr where there is no desktop session;
/// it chooses nothing for us, so it is left out there.
#[allow(unsafe_code)]
fn quiet_driver() {
    if std::env::var_os("XDG_RUNTIME_DIR").is_none() && std::env::var_os("MESA_VK_DEVICE_SELECT").is_none() {
        // SAFETY: the environment may only be changed while no other thread can read it; this is
        // the first thing that the process does, before any thread is started.
        unsafe { std::env::set_var("NODEVICE_SELECT", "1") };
    }
}
