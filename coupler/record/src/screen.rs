//! Standard error during a run, written by a separate thread: a stopped terminal (Ctrl-S), or a pipe that nobody reads,
//! does not delay a step. Messages for which the queue has no room are left out and counted; the log has all of them.

use std::io::{self, Write, stderr};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread;
use std::time::{Duration, Instant};

use interface::transport::wait::until_there;

/// Largest number of texts that wait to be shown.
const WAITING: usize = 256;
/// Time between two looks at the end.
const LOOK: Duration = Duration::from_millis(1);

/// Something to be shown.
enum Shown {
    /// A text, and the number of texts that were left out before it.
    Text(Vec<u8>, u64),
    Drawing(Box<dyn FnOnce() + Send>),
}

/// Shows text on standard error.
#[derive(Debug, Clone)]
pub struct Screen {
    queue: SyncSender<Shown>,
    counts: Arc<Counts>,
}

#[derive(Debug, Default)]
struct Counts {
    given: AtomicU64,
    shown: AtomicU64,
    left_out: AtomicU64,
}

impl Screen {
    /// Standard error of this process. Create only one.
    pub fn begin() -> Self {
        Self::of(stderr())
    }

    fn of(out: impl Write + Send + 'static) -> Self {
        let (queue, taken) = sync_channel(WAITING);
        let counts = Arc::new(Counts::default());
        let ours = counts.clone();
        thread::spawn(move || show_all(out, &taken, &ours));
        Self { queue, counts }
    }

    /// Shows a text soon, or leaves it out.
    pub fn text(&self, text: &[u8]) {
        let before = self.counts.left_out.swap(0, Ordering::Relaxed);
        if self.give(Shown::Text(text.to_vec(), before)).is_some() {
            let left_out = before + 1;
            self.counts.left_out.fetch_add(left_out, Ordering::Relaxed);
        }
    }

    /// Draws something soon; if there is no room, returns the drawing.
    pub fn draw(&self, drawing: Box<dyn FnOnce() + Send>) -> Option<Box<dyn FnOnce() + Send>> {
        match self.give(Shown::Drawing(drawing)) {
            Some(Shown::Drawing(drawing)) => Some(drawing),
            _ => None,
        }
    }

    fn give(&self, shown: Shown) -> Option<Shown> {
        self.counts.given.fetch_add(1, Ordering::AcqRel);
        let unsent = self.queue.try_send(shown).err()?;
        self.counts.given.fetch_sub(1, Ordering::AcqRel);
        let (std::sync::mpsc::TrySendError::Full(shown)
        | std::sync::mpsc::TrySendError::Disconnected(shown)) = unsent;
        Some(shown)
    }

    /// Waits until everything is shown, or nothing has been shown for `patience`.
    pub fn finish(&self, patience: Duration) {
        let mut moved = (self.counts.shown.load(Ordering::Acquire), Instant::now());
        until_there(LOOK, || {
            let shown = self.counts.shown.load(Ordering::Acquire);
            if shown != moved.0 {
                moved = (shown, Instant::now());
            }
            let all = shown >= self.counts.given.load(Ordering::Acquire);
            (all || moved.1.elapsed() >= patience).then_some(())
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

fn show_all(mut out: impl Write, taken: &Receiver<Shown>, counts: &Counts) {
    for shown in taken {
        // A reader that has closed the pipe is no error.
        match shown {
            Shown::Text(text, left_out) => {
                if left_out > 0 {
                    let _ = writeln!(out, "({left_out} messages are not shown: nobody read them)");
                }
                let _ = out.write_all(&text);
            }
            Shown::Drawing(draw) => draw(),
        }
        counts.shown.fetch_add(1, Ordering::AcqRel);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;

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

    #[test]
    fn all_is_shown_in_its_order_where_somebody_reads() {
        let (mut reader, writer) = io::pipe().unwrap();
        let screen = Screen::of(writer);
        for line in ["a\n", "b\n", "c\n"] {
            screen.text(line.as_bytes());
        }
        screen.finish(Duration::from_secs(10));
        drop(screen);
        let mut text = String::new();
        reader.read_to_string(&mut text).unwrap();
        assert_eq!(text, "a\nb\nc\n");
    }
}
