//! Chromium, which opens pages of runs (`apt-get install chromium`; `.ci/run` does it), found on the PATH or named by `CHROME`.
//! Tests that need it say without it that they are skipped.

#![allow(dead_code, reason = "each test file uses its own part")]

use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use headless_chrome::protocol::cdp::Page::CaptureScreenshotFormatOption::Png;
use headless_chrome::protocol::cdp::types::Event;
use headless_chrome::protocol::cdp::{Emulation, Network};
use headless_chrome::{Browser, LaunchOptions, Tab};
use serde_json::Value;

/// Names of the browser.
const NAMES: [&str; 4] = [
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
];

/// The browser, if there is one.
pub fn chromium() -> Option<PathBuf> {
    let named = std::env::var_os("CHROME").map(PathBuf::from);
    let path = std::env::var_os("PATH").unwrap_or_default();
    let all = std::env::split_paths(&path).flat_map(|dir| NAMES.map(|name| dir.join(name)));
    let found = named.into_iter().chain(all).find(|file| file.is_file());
    if found.is_none() {
        println!(
            "skipped: there is no Chromium (`apt-get install chromium`, or name it by the variable CHROME)"
        );
    }
    found
}

/// A browser with one page, and what it complained of or asked for.
pub struct Reader {
    /// The page.
    pub tab: Arc<Tab>,
    complaints: Arc<Mutex<Vec<String>>>,
    _browser: Browser,
}

impl Reader {
    /// Opens a file that asks nobody for anything, if there is a browser.
    pub fn open(page: &Path) -> Option<Self> {
        let url = format!("file://{}", page.display());
        Self::go(&url, &url)
    }

    /// Opens a page that may ask what begins with `own`, if there is a browser.
    pub fn go(url: &str, own: &str) -> Option<Self> {
        let chromium = chromium()?;
        let options = LaunchOptions::default_builder()
            .path(Some(chromium))
            // Chromium has no sandbox for root, whom containers have; the page is our own.
            .sandbox(false)
            .args(vec![OsStr::new("--hide-scrollbars")])
            .idle_browser_timeout(Duration::from_mins(5))
            .build()
            .unwrap();
        let browser = Browser::new(options).expect("Chromium starts");
        let tab = browser.new_tab().unwrap();
        tab.set_default_timeout(Duration::from_mins(1));
        let complaints = Arc::new(Mutex::new(Vec::new()));
        let (heard, own) = (complaints.clone(), own.to_owned());
        let listen = move |event: &Event| {
            let complaint = match event {
                Event::NetworkRequestWillBeSent(e) => {
                    let asked = &e.params.request.url;
                    let outside = !asked.starts_with(&own) && !asked.starts_with("data:");
                    outside.then(|| format!("asked for {asked}"))
                }
                Event::RuntimeExceptionThrown(e) => Some(format!("{:?}", e.params)),
                Event::RuntimeConsoleAPICalled(e) => Some(format!("{:?}", e.params)),
                Event::LogEntryAdded(e) => Some(format!("{:?}", e.params)),
                _ => None,
            };
            // A test that fails while it holds the list has said what is wrong.
            if let Ok(mut heard) = heard.lock() {
                heard.extend(complaint);
            }
        };
        tab.add_event_listener(Arc::new(listen)).unwrap();
        tab.enable_log().unwrap();
        tab.enable_runtime().unwrap();
        tab.call_method(Network::Enable {
            max_total_buffer_size: None,
            max_resource_buffer_size: None,
            max_post_data_size: None,
            report_direct_socket_traffic: None,
            enable_durable_messages: None,
        })
        .unwrap();
        tab.navigate_to(url).unwrap();
        tab.wait_for_element("html[data-ready]")
            .expect("the page starts");
        Some(Self {
            tab,
            complaints,
            _browser: browser,
        })
    }

    /// The value of an expression of the page.
    pub fn ask(&self, expression: &str) -> Value {
        let asked = format!("JSON.stringify({expression})");
        let object = self.tab.evaluate(&asked, true).expect(expression);
        let text = object.value.unwrap_or(Value::Null);
        serde_json::from_str(text.as_str().unwrap_or("null")).unwrap()
    }

    /// A number of the page.
    pub fn number(&self, expression: &str) -> f64 {
        self.ask(expression).as_f64().expect(expression)
    }

    /// Gives the page a width in pixels and a colour scheme.
    pub fn look(&self, width: u32, dark: bool) {
        let size = Emulation::SetDeviceMetricsOverride {
            width,
            height: 900,
            device_scale_factor: 1.0,
            mobile: false,
            scale: None,
            screen_width: None,
            screen_height: None,
            position_x: None,
            position_y: None,
            dont_set_visible_size: None,
            screen_orientation: None,
            viewport: None,
            display_feature: None,
            device_posture: None,
        };
        self.tab.call_method(size).unwrap();
        let scheme = if dark { "dark" } else { "light" };
        let feature = Emulation::MediaFeature {
            name: "prefers-color-scheme".into(),
            value: scheme.into(),
        };
        self.tab
            .call_method(Emulation::SetEmulatedMedia {
                media: None,
                features: Some(vec![feature]),
            })
            .unwrap();
        // What watches sizes is told with the next pictures.
        self.ask("await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(1))))");
    }

    /// A picture of all that is on the screen.
    pub fn screenshot(&self, name: &str) -> Vec<u8> {
        let picture = self.tab.capture_screenshot(Png, None, None, true).unwrap();
        // For people: where a folder is named, what the tests have seen is kept.
        if let Some(folder) = std::env::var_os("TANDEM_SCREENSHOTS") {
            fs::write(Path::new(&folder).join(format!("{name}.png")), &picture).unwrap();
        }
        picture
    }

    /// Different colours of a stage, and all of its pixels in one number.
    pub fn pixels(&self) -> (usize, f64) {
        let [colours, pixels] = [0, 1].map(|k| self.number(&format!("({PIXELS})[{k}]")));
        (colours as usize, pixels)
    }

    /// The page has complained of nothing and asked nobody else.
    #[track_caller]
    pub fn assert_silent(&self) {
        let complaints = self.complaints.lock().unwrap();
        assert!(complaints.is_empty(), "{complaints:#?}");
    }
}

/// Counts the colours of a stage, on a copy: reading a canvas again and again is what a browser warns of.
const PIXELS: &str = "(() => { const c = document.querySelector('canvas'), o = document.createElement('canvas'); \
     [o.width, o.height] = [c.width, c.height]; const x = o.getContext('2d', { willReadFrequently: true }); x.drawImage(c, 0, 0); \
     const d = new Uint32Array(x.getImageData(0, 0, c.width, c.height).data.buffer); \
     let h = 0; for (const p of d) h = (h * 31 + p) % 4294967291; return [new Set(d).size, h]; })()";
