//! Shared memory that is there no longer. A process that truncates a segment makes the pages vanish under whoever reads or writes
//! them, whom the system then ends by SIGBUS, without a word.

use std::sync::Once;

use rustix::io::write;
use signal_hook::consts::SIGBUS;
use signal_hook::low_level;

/// The last words of a process whose shared memory is gone.
const WORDS: &[u8] = b"error: shared memory of the run vanished (SIGBUS): the process at its other end has truncated it, or \
/dev/shm is full; the results so far are in the run directory\n";
/// As of any session that failed.
const FAILED: i32 = 3;

/// From now on this process says why it ends.
pub(super) fn say_so() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let end = || {
            let _ = write(std::io::stderr(), WORDS);
            low_level::exit(FAILED);
        };
        // SAFETY: what may be done in a signal handler is limited. This one makes two system calls, `write` and `_exit`: it takes no
        // lock, allocates nothing, and does not return to the access that failed.
        #[expect(unsafe_code)]
        let registered = unsafe { low_level::register(SIGBUS, end) };
        if let Err(error) = registered {
            tracing::debug!("the loss of shared memory will not be explained: {error}");
        }
    });
}
