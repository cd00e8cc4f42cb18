//! Standard error during a run, written by a separate thread: a stopped terminal (Ctrl-S), or a pipe that nobody reads,
//! does not delay a step. Messages for which the queue has no room are left out and counted; the log has all of them.

use std::fmt;
use std::io::{self, Write, stderr};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::{Duration, Instant};

use interface::transport::wait::until_there;

use crate::background::Background;

/// Largest number of texts that wait to be shown.
const WAITING: u64 = 256;
/// Time between two looks at the end.
const LOOK: Duration = Duration::from_millis(1);

/// Shows something.
pub(crate) type Drawing = Box<dyn FnOnce(&mut dyn Write) + Send>;

/// Shows text on standard error.
#[derive(Clone)]
pub struct Screen(Arc<Mutex<Queue>>);

struct Queue {
    writer: Background<Drawing>,
    /// Texts that were left out since the last one that was not.
    left_out: u64,
}

impl fmt::Debug for Screen {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Screen")
    }
}

impl Queue {
    /// Gives something to the writer; if there is no room, returns it.
    fn give(&mut self, shown: Drawing) -> Option<Drawing> {
        if self.writer.behind() >= WAITING {
            return Some(shown);
        }
        let given = self.writer.give(shown, 1);
        given.expect("what cannot be shown is no error");
        None
    }
}

impl Screen {
    /// Standard error of this process. Create only one.
    pub fn begin() -> Self {
        Self::of(stderr())
    }

    fn of(mut out: impl Write + Send + 'static) -> Self {
        let writer = Background::begin(0, move |draw: Drawing| {
            draw(&mut out);
            Ok(())
        });
        let left_out = 0;
        Self(Arc::new(Queue { writer, left_out }.into()))
    }

    fn lock(&self) -> MutexGuard<'_, Queue> {
        self.0.lock().expect("who gives does not panic")
    }

    /// Shows a text soon, or leaves it out.
    pub fn text(&self, text: &[u8]) {
        let mut queue = self.lock();
        let (text, before) = (text.to_vec(), queue.left_out);
        let unsent = queue.give(Box::new(move |out| {
            // A reader that has closed the pipe is no error.
            if before > 0 {
                let _ = writeln!(out, "({before} messages are not shown: nobody read them)");
            }
            let _ = out.write_all(&text);
        }));
        queue.left_out = unsent.map_or(0, |_| before + 1);
    }

    /// Draws something soon; if there is no room, returns the drawing.
    pub(crate) fn draw(&self, drawing: Drawing) -> Option<Drawing> {
        self.lock().give(drawing)
    }

    /// Waits until everything is shown, or nothing has been shown for `patience`.
    pub fn finish(&self, patience: Duration) {
        let behind = || self.lock().writer.behind();
        let mut moved = (behind(), Instant::now());
        until_there(LOOK, || {
            let left = behind();
            if left != moved.0 {
                moved = (left, Instant::now());
            }
            (left == 0 || moved.1.elapsed() >= patience).then_some(())
        });
    }
}

impl Write for &Screen {
    fn write(&mut self, text: &[u8]) -> io::Result<usize> {
        self.text(text);
        Ok(text.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;
    use std::thread;

    #[test]
    fn unread_output_delays_no_step_and_is_counted() {
        let (mut reader, writer) = io::pipe().unwrap();
        let screen = Screen::of(writer);
        let start = Instant::now();
        for _ in 0..2000 {
            screen.text(&[b'x'; 1024]);
        }
        screen.finish(Duration::from_millis(50));
        assert!(start.elapsed() < Duration::from_secs(10));
        let read = thread::spawn(move || {
            let mut text = String::new();
            reader.read_to_string(&mut text).unwrap();
            text
        });
        screen.finish(Duration::from_secs(10));
        screen.text(b"later\n");
        drop(screen);
        let text = read.join().unwrap();
        // Where the pipe takes a text in between, the number of texts left out before it is shown there.
        let left_out = |note: &str| note.split_once(' ')?.0.parse::<usize>().ok();
        let left_out: usize = text.split('(').skip(1).filter_map(left_out).sum();
        let shown = text.matches('x').count() / 1024;
        assert!(left_out > 0 && text.contains("messages are not shown: nobody read them)\n"));
        assert_eq!(left_out + shown, 2000);
        assert!(text.ends_with("later\n"));
    }
}
