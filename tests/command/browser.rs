//! Headless Chromium for tests of pages, driven through chromedriver (W3C WebDriver over HTTP).
//!
//! A missing browser fails the test, unless the environment variable `CAUSTICA_NO_BROWSER` is 1.

use std::{
    env,
    io::{self, BufRead, BufReader, Read, Write},
    net::TcpStream,
    path::Path,
    process::{Child, Command, Stdio},
    time::Duration,
};

use serde_json::{Value, json};
use tempfile::TempDir;

const ARGUMENTS: [&str; 9] = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-dev-shm-usage",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
];

/// One browser with one page.
pub struct Browser {
    driver: Child,
    port: u16,
    session: String,
    /// The browser's own process.
    process: String,
    profile: TempDir,
}

impl Browser {
    /// Starts it with a window of this size, pixels. `None` with `CAUSTICA_NO_BROWSER=1`.
    pub fn open(width: u32, height: u32) -> Option<Self> {
        if env::var("CAUSTICA_NO_BROWSER").is_ok_and(|v| v == "1") {
            return None;
        }
        let mut driver = Command::new("chromedriver")
            .arg("--port=0")
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap_or_else(|e| {
                panic!("chromedriver: {e}; run scripts/install-chromium, or set CAUSTICA_NO_BROWSER=1 to do without")
            });
        let mut lines = BufReader::new(driver.stdout.take().expect("it is piped")).lines();
        let port = lines
            .find_map(|line| {
                line.ok()?.split("started successfully on port ").nth(1)?.trim_end_matches('.').parse().ok()
            })
            .expect("chromedriver tells its port");
        let profile = tempfile::tempdir().expect("a temporary folder");
        let mut browser = Self { driver, port, session: String::new(), process: String::new(), profile };
        browser.start(width, height);
        Some(browser)
    }

    fn start(&mut self, width: u32, height: u32) {
        let mut arguments: Vec<String> = ARGUMENTS.map(String::from).to_vec();
        arguments.push(format!("--user-data-dir={}", self.profile.path().display()));
        arguments.push(format!("--window-size={width},{height}"));
        let capabilities = json!({"capabilities": {"alwaysMatch": {
            "browserName": "chrome",
            "goog:chromeOptions": {"args": arguments},
            "goog:loggingPrefs": {"browser": "ALL", "performance": "ALL"},
        }}});
        let session = self.call("POST", "/session", &capabilities);
        self.session = session["sessionId"].as_str().expect("a session has a name").to_string();
        self.process = session["capabilities"]["goog:processID"].to_string();
    }

    /// Clears the logs and opens a file.
    pub fn show(&self, file: &Path) {
        let path = file.canonicalize().expect("the page is there");
        self.command("POST", "/url", &json!({"url": "about:blank"}));
        self.complaints();
        self.outside_requests();
        self.command("POST", "/url", &json!({"url": format!("file://{}", path.display())}));
    }

    /// Runs JavaScript and returns its result.
    pub fn run(&self, script: &str) -> Value {
        self.command("POST", "/execute/sync", &json!({"script": script, "args": []}))
    }

    /// Presses keys in the element that the CSS selector names; arrow keys are U+E012 (left) to
    /// U+E015 (down).
    pub fn press(&self, selector: &str, keys: &str) {
        let found = self.command("POST", "/element", &json!({"using": "css selector", "value": selector}));
        let element = found.as_object().and_then(|o| o.values().next()).and_then(Value::as_str);
        let element = element.unwrap_or_else(|| panic!("no {selector}: {found}"));
        self.command("POST", &format!("/element/{element}/value"), &json!({"text": keys}));
    }

    /// Clicks the element that the CSS selector names.
    pub fn click(&self, selector: &str) {
        let found = self.command("POST", "/element", &json!({"using": "css selector", "value": selector}));
        let element = found.as_object().and_then(|o| o.values().next()).and_then(Value::as_str);
        let element = element.unwrap_or_else(|| panic!("no {selector}: {found}"));
        self.command("POST", &format!("/element/{element}/click"), &json!({}));
    }

    /// Warnings and errors of the console since the last call.
    pub fn complaints(&self) -> Vec<String> {
        let entries = self.command("POST", "/se/log", &json!({"type": "browser"}));
        let entries = entries.as_array().expect("a log is a list");
        let serious = entries.iter().filter(|e| e["level"] == "SEVERE" || e["level"] == "WARNING");
        serious.map(|e| e["message"].to_string()).collect()
    }

    /// URLs requested since the last call, without files, data URIs and the browser's own.
    pub fn outside_requests(&self) -> Vec<String> {
        let entries = self.command("POST", "/se/log", &json!({"type": "performance"}));
        let address = |entry: &Value| {
            let event: Value = serde_json::from_str(entry["message"].as_str()?).ok()?;
            let (method, params) = (&event["message"]["method"], &event["message"]["params"]);
            let address = match method.as_str()? {
                "Network.requestWillBeSent" => &params["request"]["url"],
                "Network.webSocketCreated" => &params["url"],
                _ => return None,
            };
            address.as_str().map(String::from)
        };
        let addresses = entries.as_array().expect("a log is a list").iter().filter_map(address);
        addresses
            .filter(|a| !["file:", "data:", "blob:", "about:", "chrome:"].iter().any(|inside| a.starts_with(inside)))
            .collect()
    }

    fn command(&self, method: &str, path: &str, body: &Value) -> Value {
        self.call(method, &format!("/session/{}{path}", self.session), body)
    }

    /// Sends one request to chromedriver. Returns the `value` of the response.
    fn call(&self, method: &str, path: &str, body: &Value) -> Value {
        let mut reader = BufReader::new(self.send(method, path, body).expect("chromedriver listens"));
        let mut length = 0;
        loop {
            let mut line = String::new();
            reader.read_line(&mut line).expect("chromedriver answers");
            if let Some(value) = line.to_lowercase().strip_prefix("content-length:") {
                length = value.trim().parse().expect("a length");
            }
            if line.trim().is_empty() {
                break;
            }
        }
        let mut answer = vec![0; length];
        reader.read_exact(&mut answer).expect("chromedriver answers in full");
        let answer: Value = serde_json::from_slice(&answer).expect("JSON");
        let value = answer["value"].clone();
        assert!(value.get("error").is_none_or(Value::is_null), "{method} {path}: {}", value["message"]);
        value
    }

    /// Sends a request. Returns the connection of the response.
    fn send(&self, method: &str, path: &str, body: &Value) -> io::Result<TcpStream> {
        let mut stream = TcpStream::connect(("127.0.0.1", self.port))?;
        stream.set_read_timeout(Some(Duration::from_secs(120)))?;
        let body = if body.is_null() { String::new() } else { body.to_string() };
        let length = body.len();
        write!(stream, "{method} {path} HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: {length}\r\n\r\n{body}")?;
        Ok(stream)
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        // Runs after a failed test too. A browser that does not quit is killed.
        let ended = self.send("DELETE", &format!("/session/{}", self.session), &Value::Null).and_then(|mut answer| {
            answer.set_read_timeout(Some(Duration::from_secs(10)))?;
            answer.read(&mut [0; 1])
        });
        if ended.is_err() && !self.process.is_empty() {
            let _ = Command::new("kill").args(["-KILL", &self.process]).status();
        }
        let _ = self.driver.kill();
        let _ = self.driver.wait();
    }
}
