//! What some tests need of the machine. A test without it is left out, which `tests/what_was_left_out.rs` prints at the end, or
//! fails where `TANDEM_REQUIRE` names it: `TANDEM_REQUIRE=python,chromium`.

use std::fs::{self, OpenOptions};
use std::io::Write;
use std::path::PathBuf;
use std::thread;

/// Something that a machine may lack.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Need {
    /// `python3`, and in it iceoryx2 where a test runs a solver.
    Python,
    /// A Python with YADE and iceoryx2.
    Yade,
    /// A browser.
    Chromium,
    /// Readers of VTK files and of tables in Python.
    Vtk,
    /// `pvpython`, `xvfb-run`, and Pillow in Python.
    Paraview,
    /// `qemu-x86_64`, which plays older processors.
    Qemu,
    /// The right to mount a small `/dev/shm`.
    Mount,
    /// The daemons of Slurm and munge, and root to start them.
    Slurm,
}

impl Need {
    /// Its name in `TANDEM_REQUIRE`.
    fn name(self) -> String {
        format!("{self:?}").to_lowercase()
    }

    /// Whether it is there; `why` says what is missing if not. No test goes on without it.
    #[track_caller]
    pub fn is_met(self, there: bool, why: &str) -> bool {
        let name = self.name();
        let noted = noted().join(&name);
        if there {
            // Of an earlier run that did not report it.
            let _ = fs::remove_file(noted);
            return true;
        }
        let required = std::env::var("TANDEM_REQUIRE").unwrap_or_default();
        let required = required.split(',').any(|word| word.trim() == name);
        assert!(!required, "TANDEM_REQUIRE names {name}: {why}");
        let thread = thread::current();
        let test = thread.name().unwrap_or("?");
        fs::create_dir_all(noted.parent().expect("a folder")).expect("a folder");
        let mut file = OpenOptions::new()
            .create(true)
            .append(true)
            .open(noted)
            .expect("a file");
        file.write_all(format!("{test}\t{why}\n").as_bytes())
            .expect("a line");
        false
    }
}

/// The folder of the notes: a file for each need, in it a line for each test that was left out.
fn noted() -> PathBuf {
    PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("left-out")
}
