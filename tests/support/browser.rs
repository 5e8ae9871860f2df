//! A real browser without a screen, spoken to as WebDriver says: HTTP and JSON to a driver's port.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

/// Set to anything, it makes the absence of a browser a failure.
const NEEDED: &str = "MATDB_NEED_BROWSER";
/// Key under which WebDriver names an element.
const ELEMENT: &str = "element-6066-11e4-a52e-4f735466cecf";
const PATIENCE: Duration = Duration::from_secs(20);

/// Keys that are no letters, as WebDriver writes them.
pub const TAB: &str = "\u{e004}";
pub const ENTER: &str = "\u{e007}";
pub const SPACE: &str = " ";

/// A browser with one window; it ends with the value.
pub struct Browser {
    driver: Child,
    port: u16,
    session: String,
    _profile: tempfile::TempDir,
}

impl Browser {
    /// A browser whose downloads go into a folder; `None`, with a word about it, where there is none.
    pub fn start(downloads: &Path) -> Option<Browser> {
        Browser::drawing(downloads, &["--disable-gpu"])
    }

    /// As [`Browser::start`], of one that draws in three dimensions, in software.
    pub fn in_three_dimensions(downloads: &Path) -> Option<Browser> {
        let flags = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"];
        Browser::drawing(downloads, &flags)
    }

    fn drawing(downloads: &Path, drawing: &[&str]) -> Option<Browser> {
        let driver = Command::new("chromedriver")
            .arg("--port=0")
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn();
        let mut driver = match driver {
            Ok(driver) => driver,
            Err(error) => {
                assert!(
                    std::env::var_os(NEEDED).is_none(),
                    "{NEEDED} is set and chromedriver does not start: {error}"
                );
                eprintln!(
                    "skipped: there is no chromedriver; install chromium and chromium-driver"
                );
                return None;
            }
        };
        let port = port_of(&mut driver);
        let profile = tempfile::tempdir().unwrap();
        let mut browser = Browser { driver, port, session: String::new(), _profile: profile };
        let capabilities = capabilities(browser._profile.path(), downloads, drawing);
        let answer = browser.call("POST", "/session", &capabilities);
        browser.session = answer["sessionId"].as_str().expect("a session").to_owned();
        Some(browser)
    }

    /// Opens an address and waits until it is loaded.
    pub fn open(&self, address: &str) {
        self.post("/url", &json!({ "url": address }));
    }

    /// Loads the page again.
    pub fn reload(&self) {
        self.post("/refresh", &json!({}));
    }

    /// The value of a script's `return`.
    pub fn script(&self, script: &str) -> Value {
        self.post("/execute/sync", &json!({ "script": script, "args": [] }))
    }

    /// The text of a script's `return`.
    pub fn text(&self, script: &str) -> String {
        self.script(script).as_str().unwrap_or_default().to_owned()
    }

    /// Waits until a script returns true.
    pub fn wait(&self, script: &str) {
        let start = Instant::now();
        while self.script(script) != json!(true) {
            assert!(start.elapsed() < PATIENCE, "never true: {script}\n{}", self.text(BODY));
            std::thread::sleep(Duration::from_millis(30));
        }
    }

    /// Presses keys where the focus is.
    pub fn press(&self, keys: &str) {
        let one = |key: char| {
            let key = key.to_string();
            [json!({ "type": "keyDown", "value": key }), json!({ "type": "keyUp", "value": key })]
        };
        let keys: Vec<Value> = keys.chars().flat_map(one).collect();
        let actions = json!([{ "type": "key", "id": "keyboard", "actions": keys }]);
        self.post("/actions", &json!({ "actions": actions }));
    }

    /// Presses Tab until the element of a selector has the focus.
    pub fn tab_to(&self, selector: &str) {
        for _ in 0..200 {
            if self.script(&format!("return document.activeElement.matches({})", json!(selector)))
                == json!(true)
            {
                return;
            }
            self.press(TAB);
        }
        panic!("no number of Tabs reaches {selector}");
    }

    /// Clicks as a mouse does.
    pub fn click(&self, selector: &str) {
        let wanted = json!({ "using": "css selector", "value": selector });
        let found = self.post("/element", &wanted);
        let id = found[ELEMENT].as_str().unwrap_or_else(|| panic!("no {selector}"));
        self.post(&format!("/element/{id}/click"), &json!({}));
    }

    /// Sends a command of the browser's own protocol.
    pub fn cdp(&self, command: &str, parameters: &Value) {
        self.post("/goog/cdp/execute", &json!({ "cmd": command, "params": parameters }));
    }

    /// What the console has said since it was last asked: errors, warnings and uncaught exceptions.
    pub fn console(&self) -> Vec<String> {
        self.log("browser").iter().map(|entry| entry["message"].to_string()).collect()
    }

    /// Addresses that were asked for since this was last called.
    pub fn requests(&self) -> Vec<String> {
        let message = |entry: &Value| -> Option<String> {
            let text: Value = serde_json::from_str(entry["message"].as_str()?).ok()?;
            let message = &text["message"];
            let is_request = message["method"] == "Network.requestWillBeSent";
            is_request
                .then(|| message["params"]["request"]["url"].as_str().map(str::to_owned))
                .flatten()
        };
        self.log("performance").iter().filter_map(message).collect()
    }

    fn log(&self, kind: &str) -> Vec<Value> {
        self.post("/se/log", &json!({ "type": kind })).as_array().cloned().unwrap_or_default()
    }

    fn post(&self, path: &str, body: &Value) -> Value {
        self.call("POST", &format!("/session/{}{path}", self.session), body)
    }

    fn call(&self, method: &str, path: &str, body: &Value) -> Value {
        let text = body.to_string();
        let mut stream = TcpStream::connect(("127.0.0.1", self.port)).unwrap();
        write!(
            stream,
            "{method} {path} HTTP/1.1\r\nHost: 127.0.0.1:{}\r\nContent-Type: application/json\r\n\
             Content-Length: {}\r\nConnection: close\r\n\r\n{text}",
            self.port,
            text.len()
        )
        .unwrap();
        let answer = answer(&mut BufReader::new(stream));
        let value = answer["value"].clone();
        assert!(value.get("error").is_none_or(Value::is_null), "{path}: {value}");
        value
    }

    /// Ends the browser, whatever state it is in.
    fn quit(&self) -> std::io::Result<()> {
        let mut stream = TcpStream::connect(("127.0.0.1", self.port))?;
        stream.set_read_timeout(Some(PATIENCE))?;
        write!(
            stream,
            "DELETE /session/{} HTTP/1.1\r\nHost: 127.0.0.1:{}\r\nContent-Length: 0\r\n\
             Connection: close\r\n\r\n",
            self.session, self.port
        )?;
        stream.read(&mut [0]).map(drop)
    }
}

const BODY: &str = "return document.body.innerText.slice(0, 600)";

impl Drop for Browser {
    fn drop(&mut self) {
        // Also after a failed test: a driver that is killed leaves its browser behind.
        let _ = self.quit();
        let _ = self.driver.kill();
        let _ = self.driver.wait();
    }
}

/// The port that the driver says it took.
fn port_of(driver: &mut Child) -> u16 {
    let lines = BufReader::new(driver.stdout.take().unwrap()).lines();
    let port = |line: String| {
        line.split_once("successfully on port ")?.1.trim_end_matches('.').parse::<u16>().ok()
    };
    lines.map_while(Result::ok).find_map(port).expect("the driver names its port")
}

fn capabilities(profile: &Path, downloads: &Path, drawing: &[&str]) -> Value {
    let arguments = [
        "--headless=new",
        "--no-sandbox",
        "--disable-quic",
        "--no-first-run",
        "--disable-background-networking",
        "--disable-component-update",
        "--disable-sync",
        "--disable-dev-shm-usage",
        // What scrolls slowly is not where a click expects it.
        "--force-prefers-reduced-motion",
    ];
    let mut arguments: Vec<String> =
        arguments.iter().chain(drawing).map(|a| (*a).to_owned()).collect();
    arguments.push(format!("--user-data-dir={}", profile.display()));
    json!({ "capabilities": { "alwaysMatch": {
        "browserName": "chrome",
        "goog:chromeOptions": {
            "args": arguments,
            "prefs": { "download.default_directory": downloads, "download.prompt_for_download": false },
        },
        "goog:loggingPrefs": { "browser": "ALL", "performance": "ALL" },
    } } })
}

/// The JSON of a response that ends with the connection or after its stated length.
fn answer(stream: &mut impl BufRead) -> Value {
    let mut length = None;
    loop {
        let mut line = String::new();
        stream.read_line(&mut line).unwrap();
        if line.trim().is_empty() {
            break;
        }
        if let Some((name, value)) = line.split_once(':')
            && name.eq_ignore_ascii_case("content-length")
        {
            length = value.trim().parse::<u64>().ok();
        }
    }
    let mut text = Vec::new();
    stream.take(length.unwrap_or(u64::MAX)).read_to_end(&mut text).unwrap();
    serde_json::from_slice(&text).unwrap()
}
