//! Shared memory that is there no longer. A process that truncates a segment makes the pages vanish under whoever reads or writes
//! them, whom the system then ends by SIGBUS, without a word.

use core::ptr::null_mut;
use core::sync::atomic::{AtomicPtr, Ordering};
use std::ffi::CString;
use std::os::unix::ffi::OsStrExt;
use std::path::Path;
use std::sync::Once;

use rustix::fs::{Mode, OFlags, open, rename, unlink};
use rustix::io::write;
use signal_hook::consts::SIGBUS;
use signal_hook::low_level;

/// What has happened, for people.
pub const CAUSE: &str = "shared memory of the run vanished (SIGBUS): the process at its other end has truncated it, or \
/dev/shm is full";
/// The last words of a process whose shared memory is gone.
const WORDS: &[u8] = b"error: shared memory of the run vanished (SIGBUS): the process at its other end has truncated it, or \
/dev/shm is full; the results so far are in the run directory\n";
/// As of any session that failed.
const FAILED: i32 = 3;

/// What the process leaves behind if its shared memory vanishes. Whoever swaps a pointer out of here owns it.
static LEFT: AtomicPtr<Left> = AtomicPtr::new(null_mut());

/// A file that is written in a signal handler: made before, so that nothing is allocated there.
struct Left {
    part: CString,
    whole: CString,
    content: Vec<u8>,
}

impl Left {
    /// Writes the file: whole or not at all.
    fn write(&self) -> rustix::io::Result<()> {
        // Whatever has this name: it may be a second name of another file, or a FIFO.
        let _ = unlink(&*self.part);
        let new = OFlags::WRONLY | OFlags::CREATE | OFlags::EXCL | OFlags::NOFOLLOW;
        let file = open(&*self.part, new, Mode::from_raw_mode(0o644))?;
        let mut rest = &self.content[..];
        while !rest.is_empty() {
            rest = &rest[write(&file, rest)?..];
        }
        drop(file);
        rename(&*self.part, &*self.whole)
    }
}

/// Keeps `content` for a file `name` in `dir`, which is written if the shared memory of this process vanishes. It takes the place
/// of what was kept before; `None` keeps nothing.
pub fn leave(dir: &Path, name: &str, content: Option<Vec<u8>>) {
    let path = |name: &str| CString::new(dir.join(name).as_os_str().as_bytes()).ok();
    let left = content.and_then(|content| {
        Some(Left {
            part: path(&format!(".{name}.last"))?,
            whole: path(name)?,
            content,
        })
    });
    let new = left.map_or(null_mut(), |left| Box::into_raw(Box::new(left)));
    let old = LEFT.swap(new, Ordering::AcqRel);
    if !old.is_null() {
        // SAFETY: it was made by `Box::into_raw` above, and the swap has given it to nobody else.
        #[expect(unsafe_code)]
        drop(unsafe { Box::from_raw(old) });
    }
}

/// From now on this process says why it ends.
pub(super) fn say_so() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let end = || {
            let _ = write(std::io::stderr(), WORDS);
            // SAFETY: as in `leave`; it is never freed, since the process ends.
            #[expect(unsafe_code)]
            let left = unsafe { LEFT.swap(null_mut(), Ordering::AcqRel).as_ref() };
            if let Some(left) = left {
                let _ = left.write();
            }
            low_level::exit(FAILED);
        };
        // SAFETY: what may be done in a signal handler is limited. This one makes system calls (`unlink`, `open`, `write`, `close`, `rename`,
        // `_exit`): it takes no lock, allocates and frees nothing, and does not return to the access that failed.
        #[expect(unsafe_code)]
        let registered = unsafe { low_level::register(SIGBUS, end) };
        if let Err(error) = registered {
            tracing::debug!("the loss of shared memory will not be explained: {error}");
        }
    });
}
