//! A page in a real browser: Chromium, spoken to by its own protocol (CDP), JSON texts between zero bytes over two pipes.

use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::thread;

use base64::prelude::{BASE64_STANDARD, Engine};
use serde_json::{Value, json};
use tempfile::TempDir;

use super::needs::Need;
use super::{PATIENCE, until};

/// Names of the browser.
const NAMES: [&str; 4] = [
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
];

/// The browser, if there is one.
fn chromium() -> Option<PathBuf> {
    let named = std::env::var_os("CHROME").map(PathBuf::from);
    let path = std::env::var_os("PATH").unwrap_or_default();
    let all = std::env::split_paths(&path).flat_map(|dir| NAMES.map(|name| dir.join(name)));
    let found = named.into_iter().chain(all).find(|file| file.is_file());
    let why = "no Chromium: `apt-get install chromium`, or name it by CHROME";
    Need::Chromium.is_met(found.is_some(), why);
    found
}

/// A browser with one page, and what it complained of or asked for.
pub struct Reader {
    wire: std::cell::RefCell<Wire>,
    /// What the page may ask for begins with this.
    own: String,
    _profile: TempDir,
}

impl Reader {
    /// Opens a file that asks nobody for anything, if there is a browser.
    pub fn open(page: &Path) -> Option<Self> {
        let own = format!("file://{}", page.display());
        let profile = tempfile::tempdir().expect("a directory");
        let mut wire = Wire::to(&chromium()?, profile.path());
        let target = wire.call("Target.createTarget", &json!({ "url": "about:blank" }));
        let session = json!({ "targetId": target["targetId"], "flatten": true });
        let session = wire.call("Target.attachToTarget", &session);
        wire.session = Some(session["sessionId"].clone());
        for domain in ["Log", "Runtime", "Network", "Page"] {
            wire.call(&format!("{domain}.enable"), &json!({}));
        }
        wire.call("Page.navigate", &json!({ "url": own }));
        let reader = Self {
            wire: wire.into(),
            own,
            _profile: profile,
        };
        let ready = || reader.ask_if_ready("true");
        until(PATIENCE, ready).expect("the page starts");
        Some(reader)
    }

    fn call(&self, method: &str, parameters: &Value) -> Value {
        self.wire.borrow_mut().call(method, parameters)
    }

    /// The value of an expression of the page.
    #[track_caller]
    pub fn ask(&self, expression: &str) -> Value {
        let how = json!({
            "expression": format!("JSON.stringify({expression})"),
            "replMode": true,
            "awaitPromise": true,
            "returnByValue": true,
        });
        let answer = self.call("Runtime.evaluate", &how);
        let failed = &answer["exceptionDetails"];
        assert!(failed.is_null(), "{expression}: {failed}");
        let text = answer["result"]["value"].as_str().unwrap_or("null");
        serde_json::from_str(text).unwrap()
    }

    /// The value of an expression, unless the page is between two documents or has not started.
    pub fn ask_if_ready(&self, expression: &str) -> Option<Value> {
        let asked =
            format!("document.documentElement.dataset.ready && JSON.stringify({expression})");
        let how = json!({ "expression": asked, "returnByValue": true });
        let answer = self.wire.borrow_mut().answer("Runtime.evaluate", &how);
        serde_json::from_str(answer["result"]["result"]["value"].as_str()?).ok()
    }

    /// A number of the page.
    #[track_caller]
    pub fn number(&self, expression: &str) -> f64 {
        self.ask(expression).as_f64().expect(expression)
    }

    /// Gives the page a width in pixels and a colour scheme.
    pub fn look(&self, width: u32, dark: bool) {
        let size =
            json!({ "width": width, "height": 900, "deviceScaleFactor": 1, "mobile": false });
        self.call("Emulation.setDeviceMetricsOverride", &size);
        let scheme = if dark { "dark" } else { "light" };
        let scheme = json!({ "name": "prefers-color-scheme", "value": scheme });
        self.call(
            "Emulation.setEmulatedMedia",
            &json!({ "features": [scheme] }),
        );
        // What watches sizes is called with the next pictures.
        self.ask("await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(1))))");
    }

    /// Presses a key and lets it go.
    pub fn press(&self, key: &str) {
        let code = if key == " " { "Space" } else { key };
        let number = match key {
            " " => 32,
            "End" => 35,
            "Home" => 36,
            "ArrowLeft" => 37,
            "ArrowRight" => 39,
            _ => panic!("which number has {key}?"),
        };
        let mut press = json!({ "type": "rawKeyDown", "key": key, "code": code, "windowsVirtualKeyCode": number });
        if key == " " {
            press["type"] = json!("keyDown");
            press["text"] = json!(key);
        }
        self.call("Input.dispatchKeyEvent", &press);
        let release =
            json!({ "type": "keyUp", "key": key, "code": code, "windowsVirtualKeyCode": number });
        self.call("Input.dispatchKeyEvent", &release);
    }

    /// A picture of all that is on the screen, as PNG in base64.
    pub fn screenshot(&self, name: &str) -> String {
        let picture = self.call("Page.captureScreenshot", &json!({ "format": "png" }));
        let picture = picture["data"].as_str().expect("a picture").to_owned();
        // For people: where a folder is named, what the tests have seen is kept.
        if let Some(folder) = std::env::var_os("TANDEM_SCREENSHOTS") {
            let bytes = BASE64_STANDARD.decode(&picture).unwrap();
            fs::write(Path::new(&folder).join(format!("{name}.png")), bytes).unwrap();
        }
        picture
    }

    /// Different colours of a stage, and all of its pixels in one number.
    pub fn pixels(&self) -> (usize, f64) {
        let seen = self.ask(PIXELS);
        let [colours, pixels] = [0, 1].map(|k| seen[k].as_f64().expect("two numbers"));
        (colours as usize, pixels)
    }

    /// The page has complained of nothing and asked nobody else.
    #[track_caller]
    pub fn assert_silent(&self) {
        // Messages before this answer are read with it.
        self.ask("1");
        let wire = self.wire.borrow();
        let complaints = wire.events.iter().filter(|event| self.is_complaint(event));
        let complaints: Vec<&Value> = complaints.collect();
        assert!(complaints.is_empty(), "{complaints:#?}");
    }

    fn is_complaint(&self, event: &Value) -> bool {
        match event["method"].as_str().unwrap_or_default() {
            "Network.requestWillBeSent" => {
                let asked = event["params"]["request"]["url"].as_str().unwrap();
                !asked.starts_with(&self.own) && !asked.starts_with("data:")
            }
            "Runtime.exceptionThrown" | "Runtime.consoleAPICalled" | "Log.entryAdded" => true,
            _ => false,
        }
    }
}

/// The two pipes.
struct Wire {
    browser: Child,
    out: ChildStdin,
    messages: Receiver<Value>,
    /// The page that commands are for, once there is one.
    session: Option<Value>,
    /// How many commands were sent.
    sent: u64,
    /// Messages of the browser that are no answers.
    events: Vec<Value>,
}

impl Wire {
    fn to(chromium: &Path, profile: &Path) -> Self {
        // The protocol's pipes are the files 3 and 4, which a shell can open.
        let mut browser = Command::new("sh")
            .args(["-c", "exec \"$@\" 3<&0 4>&1 0</dev/null 1>&2", "sh"])
            .arg(chromium)
            .arg("--remote-debugging-pipe")
            .arg(format!("--user-data-dir={}", profile.display()))
            // Chromium has no sandbox for root, whom containers have; the page is our own.
            .args(["--headless", "--no-sandbox", "--disable-gpu"])
            .args(["--no-first-run", "--disable-background-networking"])
            .args(["--disable-component-update", "--disable-extensions"])
            // A container's /dev/shm may be small.
            .args(["--disable-dev-shm-usage", "--hide-scrollbars"])
            .args(["--disable-renderer-backgrounding", "--mute-audio"])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("a shell starts Chromium");
        let out = browser.stdin.take().expect("a pipe");
        let mut heard = BufReader::new(browser.stdout.take().expect("a pipe"));
        let (sender, messages) = channel();
        thread::spawn(move || {
            let mut text = Vec::new();
            while heard.read_until(0, &mut text).is_ok_and(|count| count > 0) {
                text.pop();
                let message = serde_json::from_slice(&text).expect("JSON");
                text.clear();
                if sender.send(message).is_err() {
                    return;
                }
            }
        });
        let (session, sent, events) = (None, 0, Vec::new());
        Self {
            browser,
            out,
            messages,
            session,
            sent,
            events,
        }
    }

    /// The result of a command.
    fn call(&mut self, method: &str, parameters: &Value) -> Value {
        let mut answer = self.answer(method, parameters);
        assert!(answer["error"].is_null(), "{method}: {answer}");
        answer["result"].take()
    }

    /// Sends a command, and waits for its answer.
    fn answer(&mut self, method: &str, parameters: &Value) -> Value {
        self.sent += 1;
        let mut command = json!({ "id": self.sent, "method": method, "params": parameters });
        if let Some(session) = &self.session {
            command["sessionId"] = session.clone();
        }
        self.out
            .write_all(format!("{command}\0").as_bytes())
            .expect("Chromium listens");
        loop {
            let answer = self.messages.recv_timeout(PATIENCE);
            let message = answer.unwrap_or_else(|e| panic!("Chromium, {method}: {e}"));
            if message["id"] == self.sent {
                return message;
            }
            self.events.push(message);
        }
    }
}

impl Drop for Wire {
    fn drop(&mut self) {
        // Its own way to end takes its other processes along.
        let id = self.sent + 1;
        let close = format!("{}\0", json!({ "id": id, "method": "Browser.close" }));
        let asked = self.out.write_all(close.as_bytes());
        let ends = || self.browser.try_wait().ok().flatten();
        if asked.is_err() || until(PATIENCE, ends).is_none() {
            let _ = self.browser.kill();
        }
        let _ = self.browser.wait();
    }
}

/// Counts the colours of a stage, on a copy: reading a canvas again and again is what a browser warns of.
const PIXELS: &str = "(() => { const c = document.querySelector('canvas'), o = document.createElement('canvas'); \
     [o.width, o.height] = [c.width, c.height]; const x = o.getContext('2d', { willReadFrequently: true }); x.drawImage(c, 0, 0); \
     const d = new Uint32Array(x.getImageData(0, 0, c.width, c.height).data.buffer); \
     let h = 0; for (const p of d) h = (h * 31 + p) % 4294967291; return [new Set(d).size, h]; })()";
