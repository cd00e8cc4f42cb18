//! A run as its page while it goes on: an HTTP server on the loopback interface of this machine, for who has the token.
//!
//! | address | what |
//! | --- | --- |
//! | `/?token=T` | the page of the run as it stands |
//! | `/events?token=T` | server-sent events: `state` when the run has written something, `end` when it has ended |
//!
//! It reads what the run has written and writes nothing. A page is made when a browser asks for it, at most once for each
//! state; a run that nobody looks at costs a look at a few files a second.

use std::io::{self, Write};
use std::net::{Ipv4Addr, SocketAddr};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::thread;
use std::time::{Duration, Instant, SystemTime};

use coupler::record::course::COURSE;
use coupler::record::rundir::{FRAME_LIST, in_use};
use interface::files::{self, How};
use rustix::time::{ClockId, clock_gettime};
use tiny_http::{Header, Method, Request, Response, Server, StatusCode};

use crate::error::ReportError;
use crate::page;
use crate::record::Record;

/// Time between two looks at the run's files.
const LOOK: Duration = Duration::from_secs(1);
/// After a page nothing new is told for so many times the CPU time that it took: a run may need the processor, and pages of
/// large runs take long. Not the wall time: beside other work a page of a second would be the only one for an hour.
const REST: u32 = 60;
/// Time between two signs of life to a browser that waits.
const SIGN_OF_LIFE: Duration = Duration::from_secs(10);
/// How long browsers have to ask for the last page.
const FAREWELL: Duration = Duration::from_secs(10);
/// How long the last page may take to be made and sent to those that have asked for it.
const LAST_PAGE: Duration = Duration::from_mins(2);
/// Browsers that can follow at a time.
const BROWSERS: usize = 16;
/// What is shown before a run has written anything.
const NOT_YET: &str = "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><meta http-equiv=\"refresh\" content=\"1\">\
                       <title>Tandem</title><p>The run has not begun yet.</p>";

/// A server of the page of one run.
pub struct Live {
    server: Server,
    at: SocketAddr,
    shared: Arc<Shared>,
}

/// What is known to all who answer.
struct Shared {
    dir: PathBuf,
    token: String,
    host: [String; 2],
    news: Mutex<News>,
    changed: Condvar,
    page: Mutex<Option<Made>>,
    followers: AtomicUsize,
    /// Requests that are being answered.
    answering: AtomicUsize,
    /// Pages that were sent since the end.
    farewells: AtomicUsize,
}

/// A page.
struct Made {
    /// Of this state.
    state: u64,
    html: String,
    at: Instant,
    /// CPU time.
    took: Duration,
}

/// What has happened to the run.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct News {
    /// Grows with every change of its files.
    state: u64,
    ended: bool,
}

impl Live {
    /// Listens on `port` of the loopback interface; 0 takes a free one.
    ///
    /// # Errors
    /// [`ReportError::Serve`].
    pub fn listen(dir: &Path, port: u16) -> Result<Self, ReportError> {
        let at = SocketAddr::from((Ipv4Addr::LOCALHOST, port));
        let cannot = |why: &dyn std::fmt::Display| ReportError::Serve(format!("{at}: {why}"));
        let server = Server::http(at).map_err(|error| cannot(&error))?;
        let at = server
            .server_addr()
            .to_ip()
            .ok_or_else(|| cannot(&"no address"))?;
        let port = at.port();
        let shared = Shared {
            dir: dir.to_path_buf(),
            token: token().map_err(|error| cannot(&error))?,
            host: [format!("127.0.0.1:{port}"), format!("localhost:{port}")],
            news: Mutex::default(),
            changed: Condvar::new(),
            page: Mutex::default(),
            followers: AtomicUsize::new(0),
            answering: AtomicUsize::new(0),
            farewells: AtomicUsize::new(0),
        };
        Ok(Self {
            server,
            at,
            shared: Arc::new(shared),
        })
    }

    /// What to open in a browser.
    pub fn address(&self) -> String {
        format!("http://{}/?token={}", self.at, self.shared.token)
    }

    /// Answers browsers until the run has ended and those that follow it have its last page, or `stop` says so.
    ///
    /// # Errors
    /// [`ReportError::Serve`]: nothing can be heard any more.
    pub fn serve(&self, stop: impl Fn() -> bool) -> Result<(), ReportError> {
        let mut seen = None;
        let mut looked: Option<Instant> = None;
        let mut end: Option<(Instant, usize)> = None;
        while !stop() {
            if end.is_none() && looked.is_none_or(|at| at.elapsed() >= LOOK) {
                looked = Some(Instant::now());
                // In this order: after its end the run writes nothing more.
                let ended = !in_use(&self.shared.dir);
                let files = self.shared.files();
                // Before the message, because a browser that knows the end stops reading.
                let waiting = self.shared.followers.load(Ordering::Acquire);
                if ended || (seen.as_ref() != Some(&files) && self.shared.has_rested()) {
                    seen = Some(files);
                    self.shared.tell(ended);
                }
                if ended {
                    end = Some((Instant::now(), waiting));
                }
            }
            if let Some((at, waiting)) = end
                && self.shared.has_said_farewell(at, waiting)
            {
                break;
            }
            let heard = self.server.recv_timeout(Duration::from_millis(100));
            if let Some(request) = heard.map_err(|error| ReportError::Serve(error.to_string()))? {
                let shared = self.shared.clone();
                shared.answering.fetch_add(1, Ordering::AcqRel);
                thread::spawn(move || {
                    // A browser that goes away in the middle is no error.
                    let _ = shared.answer(request);
                    shared.answering.fetch_sub(1, Ordering::AcqRel);
                });
            }
        }
        Ok(())
    }
}

impl Shared {
    fn news(&self) -> MutexGuard<'_, News> {
        self.news.lock().expect("no thread panics with the news")
    }

    /// The run has written something, or has ended.
    fn tell(&self, ended: bool) {
        let mut news = self.news();
        news.state += 1;
        news.ended = ended;
        drop(news);
        self.changed.notify_all();
    }

    /// Size and time of what a run writes to while it goes on.
    fn files(&self) -> Vec<Option<(u64, SystemTime)>> {
        let names = [
            "history.csv",
            COURSE,
            "log.jsonl",
            "summary.json",
            FRAME_LIST,
        ];
        let of = |name: &str| {
            let file = files::open(&self.dir, name, How::Read)
                .ok()?
                .metadata()
                .ok()?;
            Some((file.len(), file.modified().ok()?))
        };
        names.into_iter().map(of).collect()
    }

    fn answer(&self, request: Request) -> io::Result<()> {
        let (path, query) = request.url().split_once('?').unwrap_or((request.url(), ""));
        let named = |header: &&Header| header.field.equiv("Host");
        let host = request.headers().iter().find(named);
        // A request from another site by a DNS name that points here has another host (DNS rebinding).
        let of_here =
            host.is_some_and(|host| self.host.iter().any(|own| host.value == own.as_str()));
        let knows = query
            .split('&')
            .any(|pair| pair.strip_prefix("token=") == Some(&self.token));
        let refusal = if !of_here || !knows {
            Some((
                403,
                "The address lacks the token that `tandem watch` has printed.",
            ))
        } else if !matches!(request.method(), Method::Get | Method::Head) {
            Some((405, "This server shows a run; nothing can be changed here."))
        } else {
            None
        };
        match (refusal, path) {
            (Some((status, why)), _) => {
                request.respond(Response::from_string(why).with_status_code(StatusCode(status)))
            }
            (None, "/") => self.send_page(request),
            (None, "/events") => self.send_events(request),
            (None, _) => request.respond(Response::empty(404)),
        }
    }

    fn send_page(&self, request: Request) -> io::Result<()> {
        let ended = self.news().ended;
        let html = self.page().unwrap_or_else(|_| NOT_YET.to_owned());
        let mut response = Response::from_string(html);
        for (name, value) in [
            ("Content-Type", "text/html; charset=utf-8"),
            ("Cache-Control", "no-store"),
            ("Referrer-Policy", "no-referrer"),
            ("X-Content-Type-Options", "nosniff"),
        ] {
            response.add_header(Header::from_bytes(name, value).expect("plain ASCII"));
        }
        request.respond(response)?;
        if ended {
            self.farewells.fetch_add(1, Ordering::AcqRel);
        }
        Ok(())
    }

    /// Whether the browsers that followed when the run ended, `at`, have the last page, or do not ask for it.
    fn has_said_farewell(&self, at: Instant, waiting: usize) -> bool {
        let gone = match self.answering.load(Ordering::Acquire) {
            0 => FAREWELL,
            _ => LAST_PAGE,
        };
        self.farewells.load(Ordering::Acquire) >= waiting || at.elapsed() >= gone
    }

    /// Whether the last page is old enough for another one.
    fn has_rested(&self) -> bool {
        // Who holds it makes one.
        let Ok(made) = self.page.try_lock() else {
            return false;
        };
        made.as_ref()
            .is_none_or(|made| made.at.elapsed() >= REST * made.took)
    }

    /// The page of the present state. One that was made for it is sent again.
    fn page(&self) -> Result<String, ReportError> {
        let mut made = self.page.lock().expect("no thread panics with the page");
        let News { state, ended } = *self.news();
        if let Some(made) = made.as_ref().filter(|made| made.state == state) {
            return Ok(made.html.clone());
        }
        let begun = cpu_time();
        let record = Record::read(&self.dir)?;
        let html = page::page(&[record], !ended)?;
        *made = Some(Made {
            state,
            html: html.clone(),
            at: Instant::now(),
            took: cpu_time().saturating_sub(begun),
        });
        Ok(html)
    }

    fn send_events(&self, request: Request) -> io::Result<()> {
        if self.followers.fetch_add(1, Ordering::AcqRel) >= BROWSERS {
            self.followers.fetch_sub(1, Ordering::AcqRel);
            return request.respond(Response::empty(503));
        }
        let mut out = request.into_writer();
        let told = self.follow(&mut out);
        self.followers.fetch_sub(1, Ordering::AcqRel);
        told
    }

    /// Tells of every change until the end.
    fn follow(&self, out: &mut dyn Write) -> io::Result<()> {
        out.write_all(
            b"HTTP/1.1 200 OK\r\nContent-Type: text/event-stream\r\nCache-Control: no-store\r\nConnection: close\r\n\r\n",
        )?;
        let mut told = 0;
        loop {
            let news = self.news();
            let waited = self
                .changed
                .wait_timeout_while(news, SIGN_OF_LIFE, |news| news.state == told);
            let news = *waited.expect("no thread panics with the news").0;
            if news.state == told {
                out.write_all(b": still here\n\n")?;
            } else {
                told = news.state;
                let name = if news.ended { "end" } else { "state" };
                write!(out, "event: {name}\ndata: {told}\n\n")?;
            }
            out.flush()?;
            if news.ended {
                return Ok(());
            }
        }
    }
}

/// CPU time of this thread.
fn cpu_time() -> Duration {
    let t = clock_gettime(ClockId::ThreadCPUTime);
    Duration::new(t.tv_sec.unsigned_abs(), t.tv_nsec as u32)
}

/// 128 bits that nobody can guess.
fn token() -> io::Result<String> {
    let mut bytes = [0; 16];
    getrandom::fill(&mut bytes)?;
    Ok(format!("{:032x}", u128::from_le_bytes(bytes)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The last page of a long run on a busy machine took longer than browsers had to fetch it, and none got it.
    #[test]
    fn a_browser_that_has_asked_for_the_last_page_gets_it_however_long_that_takes_to_make() {
        let folder = tempfile::tempdir().unwrap();
        let shared = Live::listen(folder.path(), 0).unwrap().shared;
        let (now, long_ago) = (Instant::now(), Instant::now().checked_sub(2 * FAREWELL));
        let long_ago = long_ago.unwrap();
        assert!(shared.has_said_farewell(now, 0));
        assert!(!shared.has_said_farewell(now, 1));
        assert!(shared.has_said_farewell(long_ago, 1), "nobody asks");
        shared.answering.store(1, Ordering::Release);
        assert!(!shared.has_said_farewell(long_ago, 1));
        shared.farewells.store(1, Ordering::Release);
        assert!(shared.has_said_farewell(long_ago, 1));
    }

    /// Who makes pages all the time takes a processor from the run.
    #[test]
    fn after_a_page_it_rests_for_many_times_as_long_as_that_took() {
        let folder = tempfile::tempdir().unwrap();
        let shared = Live::listen(folder.path(), 0).unwrap().shared;
        assert!(shared.has_rested());
        let made = |took| Made {
            state: 1,
            html: String::new(),
            at: Instant::now(),
            took,
        };
        *shared.page.lock().unwrap() = Some(made(Duration::from_mins(1)));
        assert!(!shared.has_rested());
        *shared.page.lock().unwrap() = Some(made(Duration::ZERO));
        assert!(shared.has_rested());
        let being_made = shared.page.lock().unwrap();
        assert!(!shared.has_rested());
        drop(being_made);
        assert!(shared.has_rested());
    }
}
