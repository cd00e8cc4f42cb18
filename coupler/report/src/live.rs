//! A run as its page while it goes on: an HTTP server on the loopback interface of this machine, for who has the token.
//!
//! | address | what |
//! | --- | --- |
//! | `/?token=T` | the page of the run as it stands |
//! | `/news?token=T&after=N` | the number of the run's state, once it is not `N`, and whether the run has ended |
//!
//! It reads what the run has written and writes nothing. A page is made when a browser asks for it, at most once for each
//! state; a run that nobody looks at costs a look at a few files a second.

use std::convert::Infallible;
use std::io;
use std::net::{Ipv4Addr, SocketAddr, TcpListener};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant, SystemTime};

use coupler::record::rundir::{COURSE, FRAME_LIST, in_use};
use http_body_util::Full;
use hyper::body::{Bytes, Incoming};
use hyper::header::{self, HeaderValue};
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper::{Method, Request, Response, StatusCode};
use hyper_util::rt::{TokioIo, TokioTimer};
use interface::files::{self, How};
use rustix::time::{ClockId, clock_gettime};
use tokio::net::TcpStream;
use tokio::sync::watch;
use tokio::time::{sleep, timeout};

use crate::error::ReportError;
use crate::page;
use crate::record::Record;

/// Time between two looks at the run's files.
const LOOK: Duration = Duration::from_secs(1);
/// After a page there is no news for so many times the CPU time that it took: a run may need the processor, and pages of
/// large runs take long. Not the wall time: beside other work a page of a second would be the only one for an hour.
const REST: u32 = 60;
/// Longest wait of a browser for news; then it asks again.
const NO_NEWS: Duration = Duration::from_secs(10);
/// How long a browser that follows has to ask again, or for the last page.
const FAREWELL: Duration = Duration::from_secs(10);
/// How long an answer may take; the last page of a large run takes long.
const ANSWER: Duration = Duration::from_mins(2);
/// Connections at a time; more are closed at once.
const CONNECTIONS: usize = 64;
/// How long a browser may take to send its request.
const REQUEST: Duration = Duration::from_secs(5);
/// Largest head of a request in bytes.
const HEAD: usize = 16 << 10;
/// Threads that make pages, of which one at a time does.
const MAKERS: usize = 4;
/// Time between two looks at whether to stop.
const TICK: Duration = Duration::from_millis(100);
/// What is shown before a run has written anything.
const NOT_YET: &str = "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><meta http-equiv=\"refresh\" content=\"1\">\
                       <title>Tandem</title><p>The run has not begun yet.</p>";

/// A server of the page of one run.
pub struct Live {
    listener: TcpListener,
    at: SocketAddr,
    shared: Arc<Shared>,
}

/// What is known to all who answer.
struct Shared {
    dir: PathBuf,
    token: String,
    host: [String; 2],
    news: watch::Sender<News>,
    page: Mutex<Option<Made>>,
    /// Connections, each of one request.
    answering: AtomicUsize,
    /// When an answer was last sent, once a browser has asked for news.
    last_news: Mutex<Option<Instant>>,
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
        let listener = TcpListener::bind(at).map_err(|error| cannot(&error))?;
        listener
            .set_nonblocking(true)
            .map_err(|error| cannot(&error))?;
        let at = listener.local_addr().map_err(|error| cannot(&error))?;
        let port = at.port();
        let shared = Shared {
            dir: dir.to_path_buf(),
            token: token().map_err(|error| cannot(&error))?,
            host: [format!("127.0.0.1:{port}"), format!("localhost:{port}")],
            news: watch::Sender::new(News::default()),
            page: Mutex::default(),
            answering: AtomicUsize::new(0),
            last_news: Mutex::default(),
        };
        Ok(Self {
            listener,
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
        let mut runtime = tokio::runtime::Builder::new_current_thread();
        let runtime = runtime.enable_all().max_blocking_threads(MAKERS).build();
        let cannot = |error: io::Error| ReportError::Serve(error.to_string());
        let runtime = runtime.map_err(cannot)?;
        let served = runtime.block_on(self.answer_all(stop)).map_err(cannot);
        // A page that is being made is for nobody.
        runtime.shutdown_background();
        served
    }

    async fn answer_all(&self, stop: impl Fn() -> bool) -> io::Result<()> {
        let listener = tokio::net::TcpListener::from_std(self.listener.try_clone()?)?;
        let mut seen = None;
        let mut looked: Option<Instant> = None;
        let mut ended = false;
        while !stop() {
            if !ended && looked.is_none_or(|at| at.elapsed() >= LOOK) {
                looked = Some(Instant::now());
                // In this order: after its end the run writes nothing more.
                ended = !in_use(&self.shared.dir);
                let files = self.shared.files();
                if ended || (seen.as_ref() != Some(&files) && self.shared.has_rested()) {
                    seen = Some(files);
                    self.shared.publish(ended);
                }
            }
            if ended && self.shared.is_left_alone() {
                break;
            }
            match timeout(TICK, listener.accept()).await {
                Err(_) => {}
                Ok(Ok((stream, _))) => {
                    if self.shared.answering.load(Ordering::Acquire) < CONNECTIONS {
                        self.shared.answering.fetch_add(1, Ordering::AcqRel);
                        tokio::spawn(connection(self.shared.clone(), stream));
                    }
                }
                // Too many files are open: those of others are closed after a while.
                Ok(Err(_)) => sleep(TICK).await,
            }
        }
        Ok(())
    }
}

/// Answers one request, in bounded time.
async fn connection(shared: Arc<Shared>, stream: TcpStream) {
    let answers = service_fn(|request| {
        let shared = shared.clone();
        async move { Ok::<_, Infallible>(shared.answer(&request).await) }
    });
    let serving = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(REQUEST)
        .max_buf_size(HEAD)
        .keep_alive(false)
        .serve_connection(TokioIo::new(stream), answers);
    // A browser that goes away in the middle is no error.
    let _ = timeout(ANSWER, serving).await;
    let mut last = shared.last_news.lock().expect("no thread panics with it");
    *last = last.map(|_| Instant::now());
    shared.answering.fetch_sub(1, Ordering::AcqRel);
}

type Answer = Response<Full<Bytes>>;

/// An answer that nobody keeps.
fn whole(status: StatusCode, kind: &'static str, text: impl Into<Bytes>) -> Answer {
    let mut answer = Response::new(Full::new(text.into()));
    *answer.status_mut() = status;
    for (name, value) in [
        (header::CONTENT_TYPE, kind),
        (header::CACHE_CONTROL, "no-store"),
        (header::REFERRER_POLICY, "no-referrer"),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    ] {
        let value = HeaderValue::from_static(value);
        answer.headers_mut().insert(name, value);
    }
    answer
}

impl Shared {
    /// The run has written something, or has ended.
    fn publish(&self, ended: bool) {
        self.news.send_modify(|news| {
            news.state += 1;
            news.ended = ended;
        });
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

    async fn answer(self: Arc<Self>, request: &Request<Incoming>) -> Answer {
        let refused = |status, why: &'static str| whole(status, "text/plain", why);
        let query = request.uri().query().unwrap_or_default();
        let value = |key: &str| query.split('&').find_map(|pair| pair.strip_prefix(key));
        // A request from another site by a DNS name that points here has another host (DNS rebinding).
        let host = request.headers().get(header::HOST);
        let of_here = host.is_some_and(|host| self.host.iter().any(|own| host == own.as_str()));
        if !of_here || value("token=") != Some(&self.token) {
            let why = "The address lacks the token that `tandem watch` has printed.";
            return refused(StatusCode::FORBIDDEN, why);
        }
        if !matches!(*request.method(), Method::GET | Method::HEAD) {
            let why = "This server shows a run; nothing can be changed here.";
            return refused(StatusCode::METHOD_NOT_ALLOWED, why);
        }
        let after = value("after=").and_then(|state| state.parse().ok());
        match request.uri().path() {
            "/" => self.send_page().await,
            "/news" => self.send_news(after.unwrap_or(0)).await,
            _ => refused(StatusCode::NOT_FOUND, ""),
        }
    }

    async fn send_page(self: Arc<Self>) -> Answer {
        let made = tokio::task::spawn_blocking(move || self.page()).await;
        let html = made.ok().and_then(Result::ok);
        let html = html.unwrap_or_else(|| NOT_YET.to_owned());
        whole(StatusCode::OK, "text/html; charset=utf-8", html)
    }

    /// The state as soon as it is another one than this.
    async fn send_news(&self, after: u64) -> Answer {
        let mut news = self.news.subscribe();
        let _ = timeout(NO_NEWS, news.wait_for(|news| news.state != after)).await;
        let News { state, ended } = *self.news.borrow();
        *self.last_news.lock().expect("no thread panics with it") = Some(Instant::now());
        let news = format!("{{\"state\":{state},\"ended\":{ended}}}");
        whole(StatusCode::OK, "application/json", news)
    }

    /// Whether no request is being answered, and no browser has asked for news so lately that it may ask again.
    fn is_left_alone(&self) -> bool {
        let last = *self.last_news.lock().expect("no thread panics with it");
        self.answering.load(Ordering::Acquire) == 0
            && last.is_none_or(|at| at.elapsed() >= FAREWELL)
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
        let News { state, ended } = *self.news.borrow();
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
        assert!(shared.is_left_alone(), "nobody has followed");
        *shared.last_news.lock().unwrap() = Some(Instant::now());
        assert!(!shared.is_left_alone());
        *shared.last_news.lock().unwrap() = Instant::now().checked_sub(2 * FAREWELL);
        assert!(shared.is_left_alone());
        shared.answering.store(1, Ordering::Release);
        assert!(!shared.is_left_alone());
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
