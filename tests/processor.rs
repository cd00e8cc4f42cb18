//! The instruction level: a build for an older one, and a processor that lacks it.

use std::process::Command;

use crate::harness::needs::Need;
use crate::harness::{has, root};

/// What rustc says of the file that asks for the level, compiled alone.
fn compiled(level: &str) -> (bool, String) {
    let out = tempfile::tempdir().unwrap();
    let ended = Command::new("rustc")
        .args(["--edition=2024", "--crate-type=lib", "--emit=metadata"])
        .arg(format!("-Ctarget-cpu={level}"))
        .arg("--out-dir")
        .arg(out.path())
        .arg(root().join("mpm-proc/src/level.rs"))
        .current_dir(root())
        .output()
        .unwrap();
    let stderr = String::from_utf8(ended.stderr).unwrap();
    (ended.status.success(), stderr)
}

/// As `cargo install` from elsewhere makes it, or `RUSTFLAGS` in the environment.
#[test]
#[cfg(target_arch = "x86_64")]
fn a_build_for_older_processors_says_what_to_do() {
    for level in ["x86-64", "x86-64-v2", "sandybridge"] {
        let (built, stderr) = compiled(level);
        assert!(!built, "{level}");
        assert!(stderr.contains("RUSTFLAGS"), "{level}: {stderr}");
        assert!(
            stderr.contains("-C target-cpu=x86-64-v3"),
            "{level}: {stderr}"
        );
    }
    for level in ["x86-64-v3", "x86-64-v4", "haswell"] {
        let (built, stderr) = compiled(level);
        assert!(built, "{level}: {stderr}");
    }
}

/// Emulated: Nehalem of 2008, Sandy Bridge of 2011, which has AVX, and one with all that QEMU knows.
#[test]
#[cfg(target_arch = "x86_64")]
fn a_processor_without_avx2_is_told_apart_before_main() {
    let emulator = "qemu-x86_64";
    let there = Command::new(emulator).arg("--version").output().is_ok();
    if !Need::Qemu.is_met(there, "there is no qemu-x86_64 (Debian: qemu-user)") {
        return;
    }
    let on = |processor: &str| {
        let mut emulated = Command::new(emulator);
        emulated.args(["-cpu", processor, env!("CARGO_BIN_EXE_tandem"), "--version"]);
        emulated.output().unwrap()
    };
    for old in ["Nehalem", "SandyBridge"] {
        let ended = on(old);
        let stderr = String::from_utf8_lossy(&ended.stderr);
        assert_eq!(ended.status.code(), Some(2), "{old}: {stderr}");
        has(&stderr, "a processor with AVX2 and FMA");
        assert!(ended.stdout.is_empty(), "{old}");
    }
    let ended = on("max");
    let stdout = String::from_utf8_lossy(&ended.stdout);
    assert_eq!(ended.status.code(), Some(0), "{ended:?}");
    assert!(stdout.starts_with("tandem "), "{stdout}");
}
