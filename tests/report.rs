//! The report in a real browser: a headless Chromium driven by the DevTools protocol over a pair of pipes, with the mouse
//! of a person. Without Chromium the browser tests say so and pass, but for CI, which has to have it.
#![cfg(unix)]

use serde_json::{Value, json};
use std::fs::{self, File};
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command};

mod webassembly;

const BROWSERS: [&str; 3] = ["chromium", "chromium-browser", "google-chrome"];

/// A folder of one test's own.
fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&path);
    fs::create_dir_all(&path).unwrap();
    path
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Runs the program in a folder.
#[track_caller]
fn gonogo(folder: &Path, args: &[&str]) {
    let output = Command::new(env!("CARGO_BIN_EXE_gonogo")).args(args).current_dir(folder).output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
}

/// The page of a spec, written by the program itself.
fn page(spec: &Path, folder: &Path) -> PathBuf {
    gonogo(folder, &["report", spec.to_str().unwrap(), "-o", "report.html"]);
    folder.join("report.html")
}

/// A file name that would be markup, were it not escaped.
const SPITE: &str = "a\"><img src=x onerror=document.title='broken'>.png";

/// The page of the small plate with its model, a good photo, a faulty one and rubbish.
fn judged(folder: &Path) -> PathBuf {
    fs::copy(root().join("tests/data/two_pins.gng"), folder.join("plate.gng")).unwrap();
    gonogo(folder, &["compile", "plate.gng", "--emit", "images,model"]);
    let images = folder.join("plate.images");
    fs::rename(images.join("good.png"), folder.join("good.png")).unwrap();
    fs::rename(images.join("01 pin[1] missing.png"), folder.join(SPITE)).unwrap();
    fs::write(folder.join("rubbish.png"), "not an image").unwrap();
    gonogo(folder, &["calibrate", "plate.model.ron", "good.png", "-o", "plate.calibration.ron"]);
    let model = ["--model", "plate.model.ron", "--calibration", "plate.calibration.ron"];
    let photos = ["good.png", SPITE, "rubbish.png"];
    gonogo(folder, &[&["report", "plate.gng", "-o", "report.html"], &model[..], &photos].concat());
    folder.join("report.html")
}

/// The browser, or `None` where there is none and none has to be.
fn browser() -> Option<&'static str> {
    let there = |name: &&str| {
        let which = Command::new("sh").args(["-c", "command -v \"$0\"", name]).output();
        which.is_ok_and(|o| o.status.success())
    };
    let found = BROWSERS.into_iter().find(there);
    if found.is_none() {
        let in_ci = std::env::var_os("CI").is_some_and(|v| !v.is_empty());
        assert!(!in_ci, "CI needs a Chromium: apt-get install chromium");
        eprintln!("SKIPPED: no Chromium here (apt-get install chromium)");
    }
    found
}

/// A page in a browser.
struct Tab {
    browser: Child,
    to: File,
    from: BufReader<File>,
    session: String,
    calls: u64,
    /// What the browser said unasked.
    events: Vec<Value>,
}

impl Tab {
    fn open(name: &str, folder: &Path, page: &Path, [width, height]: [u32; 2]) -> Tab {
        let [to, from] = ["to", "from"].map(|pipe| folder.join(pipe));
        assert!(Command::new("mkfifo").args([&to, &from]).status().unwrap().success());
        // The browser reads commands from its descriptor 3 and answers on 4.
        let script = "exec \"$0\" --headless --no-sandbox --disable-gpu --disable-quic --no-first-run \
                      --disable-background-networking --disable-component-update --disable-sync --disable-dev-shm-usage \
                      --remote-debugging-pipe --user-data-dir=\"$3\" about:blank 3<\"$1\" 4>\"$2\" 2>/dev/null";
        let browser =
            Command::new("sh").args(["-c", script, name]).args([&to, &from, &folder.join("profile")]).spawn().unwrap();
        let to = File::options().write(true).open(to).unwrap();
        let from = BufReader::new(File::open(from).unwrap());
        let mut tab = Tab { browser, to, from, session: String::new(), calls: 0, events: Vec::new() };
        let target = tab.call("Target.createTarget", json!({"url": "about:blank"}));
        let attached = tab.call("Target.attachToTarget", json!({"targetId": target["targetId"], "flatten": true}));
        tab.session = attached["sessionId"].as_str().unwrap().into();
        for domain in ["Page", "Runtime", "Network", "Log"] {
            tab.call(&format!("{domain}.enable"), json!({}));
        }
        let size = json!({"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600});
        tab.call("Emulation.setDeviceMetricsOverride", size);
        tab.call("Page.navigate", json!({"url": format!("file://{}", page.display())}));
        tab.until("document.readyState === 'complete' && !!window.gonogo");
        tab.settle();
        tab
    }

    fn call(&mut self, method: &str, params: Value) -> Value {
        self.calls += 1;
        let mut command = json!({"id": self.calls, "method": method, "params": params});
        if !self.session.is_empty() {
            command["sessionId"] = json!(self.session);
        }
        self.to.write_all(format!("{command}\0").as_bytes()).unwrap();
        self.to.flush().unwrap();
        loop {
            let mut answer = Vec::new();
            self.from.read_until(0, &mut answer).unwrap();
            assert_eq!(answer.pop(), Some(0), "the browser has gone");
            let answer: Value = serde_json::from_slice(&answer).unwrap();
            if answer["id"] == json!(self.calls) {
                assert!(answer["error"].is_null(), "{method}: {answer}");
                return answer["result"].clone();
            }
            self.events.push(answer);
        }
    }

    /// The value of an expression in the page.
    fn value(&mut self, expression: &str) -> Value {
        let asked = json!({"expression": expression, "returnByValue": true, "awaitPromise": true});
        let answer = self.call("Runtime.evaluate", asked);
        assert!(answer["exceptionDetails"].is_null(), "{expression}: {answer}");
        answer["result"]["value"].clone()
    }

    fn text(&mut self, expression: &str) -> String {
        self.value(expression).as_str().unwrap_or_default().into()
    }

    fn until(&mut self, condition: &str) {
        let waiting = format!(
            "new Promise((done, gone) => {{ const start = Date.now(); (function ask() {{ if ({condition}) done(true); \
             else if (Date.now() - start > 30000) gone('never: ' + {}); else setTimeout(ask, 20); }})(); }})",
            json!(condition)
        );
        assert_eq!(self.value(&waiting), json!(true));
    }

    /// Until nothing moves any more and the picture is drawn.
    fn settle(&mut self) {
        self.value("new Promise((done) => setTimeout(done, 250))");
        self.until("!gonogo.viewer.moving && !gonogo.viewer.pending");
    }

    fn mouse(&mut self, kind: &str, [x, y]: [f64; 2], buttons: u32) {
        let button = if kind == "mouseMoved" && buttons == 0 { "none" } else { "left" };
        let event = json!({"type": kind, "x": x, "y": y, "button": button, "buttons": buttons, "clickCount": 1});
        self.call("Input.dispatchMouseEvent", event);
    }

    fn click(&mut self, at: [f64; 2]) {
        self.mouse("mouseMoved", at, 0);
        self.mouse("mousePressed", at, 1);
        self.mouse("mouseReleased", at, 0);
        self.settle();
    }

    /// Chooses a file in an input.
    fn choose(&mut self, id: &str, path: &str) {
        let input = self.call("Runtime.evaluate", json!({"expression": format!("document.getElementById('{id}')")}));
        let id = &input["result"]["objectId"];
        self.call("DOM.setFileInputFiles", json!({"files": [path], "objectId": id}));
    }

    /// Drops a file on an element, as from a file manager.
    fn drop_at(&mut self, id: &str, path: &str) {
        let at = self.value(&format!(
            "(() => {{ const e = document.getElementById('{id}'); e.scrollIntoView({{ block: 'center' }}); \
             const b = e.getBoundingClientRect(); return [b.left + b.width / 2, b.top + b.height / 2]; }})()"
        ));
        let data = json!({"items": [], "files": [path], "dragOperationsMask": 1});
        for kind in ["dragEnter", "dragOver", "drop"] {
            self.call("Input.dispatchDragEvent", json!({"type": kind, "x": at[0], "y": at[1], "data": data}));
        }
    }

    /// Where a face of that name is seen in the window.
    fn find(&mut self, face: &str) -> Option<[f64; 2]> {
        let found = self.value(&format!(
            "(() => {{ const box = document.getElementById('canvas').getBoundingClientRect(), at = gonogo.find({}); \
             return at && [box.left + at[0], box.top + at[1]]; }})()",
            json!(face)
        ));
        Some([found[0].as_f64()?, found[1].as_f64()?])
    }

    /// Pixels of the canvas that show something, and a digest of them all.
    fn picture(&mut self) -> (u64, u64) {
        let picture = self.value(
            "(() => { const c = document.getElementById('canvas'), d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data; \
             let seen = 0, sum = 0; for (let i = 0; i < d.length; i++) { sum = (Math.imul(sum, 31) + d[i]) >>> 0; \
             if (i % 4 === 3 && d[i]) seen++; } return [seen, sum]; })()",
        );
        (picture[0].as_u64().unwrap(), picture[1].as_u64().unwrap())
    }

    /// Sets a control as a hand would: its value, then the events.
    fn set(&mut self, id: &str, value: &str) {
        self.value(&format!(
            "(() => {{ const e = document.getElementById({}); e.value = {}; e.dispatchEvent(new Event('input')); \
             e.dispatchEvent(new Event('change')); }})()",
            json!(id),
            json!(value)
        ));
        self.settle();
    }

    /// What went wrong in the page, and what it asked of the network.
    fn complaints(&mut self) -> Vec<String> {
        // Whatever is on its way arrives before the next answer.
        self.value("1");
        let complaint = |event: &Value| {
            let params = &event["params"];
            match event["method"].as_str()? {
                "Runtime.exceptionThrown" => Some(params["exceptionDetails"].to_string()),
                "Runtime.consoleAPICalled" => Some(params["args"].to_string()),
                "Log.entryAdded" => Some(params["entry"].to_string()),
                "Network.requestWillBeSent" => {
                    let url = params["request"]["url"].as_str()?;
                    let own = url.starts_with("data:") || url.ends_with("/report.html");
                    (!own).then(|| format!("asked for {url}"))
                }
                _ => None,
            }
        };
        self.events.iter().filter_map(complaint).collect()
    }
}

impl Drop for Tab {
    fn drop(&mut self) {
        // The pipe's end ends the browser; what does not hear is killed.
        let _ = self.browser.kill();
        let _ = self.browser.wait();
    }
}

#[test]
fn a_person_turns_explodes_and_clicks() {
    let Some(name) = browser() else { return };
    let folder = folder("report_browser");
    let page = page(&root().join("tests/data/two_pins.gng"), &folder);
    let mut tab = Tab::open(name, &folder, &page, [1280, 900]);

    let (seen, assembled) = tab.picture();
    assert!(seen > 10_000, "only {seen} pixels show something");

    tab.set("explode", "100");
    let (_, apart) = tab.picture();
    assert_ne!(apart, assembled, "the slider changes nothing");
    tab.set("explode", "0");
    assert_eq!(tab.picture().1, assembled, "back together it looks otherwise");

    // The face that most others touch lies open once the assembly is apart.
    tab.set("explode", "100");
    let face = tab.text(
        "(() => { const d = JSON.parse(document.getElementById('data').textContent); const name = ([c, f]) => \
         d.components[c].name + '.' + d.meshes[d.components[c].mesh].names[f][0]; \
         return d.contacts.flatMap((t) => [t.a, t.b]).map(name).find((n) => gonogo.find(n)) || ''; })()",
    );
    let at = tab.find(&face).expect("a face that touches something can be seen");
    tab.click(at);
    assert_eq!(tab.text("document.getElementById('canvas').dataset.selected"), face);
    let about = tab.text("document.getElementById('about').textContent");
    assert!(about.contains(&face) && about.contains("Touches") && about.contains("MMC"), "{about}");
    let touching = tab.value("document.querySelectorAll('#about .touch').length");
    assert!(touching.as_u64().unwrap() > 0, "{about}");

    // A contact leads to the face on its other side.
    let partner = tab.text("document.querySelector('#about .touch b').textContent");
    tab.value("document.querySelector('#about .touch').click()");
    tab.settle();
    assert_eq!(tab.text("document.querySelector('#about h3').textContent"), partner);

    let (_, before) = tab.picture();
    tab.mouse("mousePressed", at, 1);
    tab.mouse("mouseMoved", [at[0] + 60.0, at[1] + 10.0], 1);
    tab.mouse("mouseReleased", [at[0] + 60.0, at[1] + 10.0], 0);
    tab.settle();
    assert_ne!(tab.picture().1, before, "dragging does not turn it");
    assert_eq!(tab.complaints(), Vec::<String>::new());
}

#[test]
fn photos_and_promises_can_be_looked_at() {
    let Some(name) = browser() else { return };
    let folder = folder("report_judged");
    let page = judged(&folder);
    let mut tab = Tab::open(name, &folder, &page, [1280, 900]);
    let verdicts = tab.value("[...document.querySelectorAll('.photo .verdict')].map((v) => v.textContent)");
    assert_eq!(verdicts, json!(["go", "no-go", "cannot inspect"]));
    assert!(!tab.text("document.title").contains("broken"));
    let counted = |tab: &mut Tab, what: &str| tab.value(&format!("document.querySelectorAll({}).length", json!(what)));
    assert_eq!(counted(&mut tab, "#photo-0 .drawn g.good"), json!(2));
    assert_eq!(counted(&mut tab, "#photo-1 .drawn g.faulty path"), json!(1));
    assert!(counted(&mut tab, "#promise svg.bar").as_u64().unwrap() > 2);
    // Closed details hold pictures too.
    tab.value("document.querySelectorAll('details').forEach((d) => { d.open = true; })");
    tab.until("[...document.images].every((i) => i.complete && i.naturalWidth > 0)");
    assert!(tab.value("document.images.length").as_u64().unwrap() >= 8);

    let (_, before) = tab.picture();
    tab.set("colours", "risk");
    assert_ne!(tab.picture().1, before, "the chance of an escape has no colour");
    tab.value("document.querySelector('nav button').click()");
    let paper = tab.text("getComputedStyle(document.body).backgroundColor");
    assert_eq!(paper, "rgb(16, 21, 28)", "the dark theme is not dark");

    // Pointing at a photo's box points at the component in 3-D.
    tab.value("document.querySelector('#photo-1 .drawn g.faulty').dispatchEvent(new MouseEvent('mouseenter'))");
    assert_eq!(counted(&mut tab, ".parts button.on"), json!(1));
    assert_eq!(tab.complaints(), Vec::<String>::new());
}

/// A person chooses a photo, then drops another: the page judges both as the command line does, to the letter.
#[test]
fn the_page_judges_photos_itself() {
    let Some(name) = browser() else { return };
    let Some(module) = webassembly::module() else { return };
    let folder = folder("report_judge");
    let page = judged(&folder);
    let without = fs::read_to_string(&page).unwrap();
    assert!(!without.contains("wasm-unsafe-eval") && !without.contains("id=\"judge\""));
    let model = ["--model", "plate.model.ron", "--calibration", "plate.calibration.ron"];
    let judge = ["--judge", module.to_str().unwrap()];
    gonogo(&folder, &[&["report", "plate.gng", "-o", "report.html"], &model[..], &judge].concat());
    let photos = ["good.png", SPITE, "rubbish.png"];
    let mut native = Command::new(env!("CARGO_BIN_EXE_gonogo"));
    native.current_dir(&folder).args(["inspect", "plate.model.ron", "--calibration", "plate.calibration.ron"]);
    let native = native.args(["--format", "json"]).args(photos).output().unwrap();
    let native = String::from_utf8(native.stdout).unwrap();
    let native: Vec<&str> = native.lines().map(|line| line.split_once(",\"milliseconds\"").unwrap().0).collect();
    assert_eq!(native.len(), 3);

    let mut tab = Tab::open(name, &folder, &page, [1280, 900]);
    let path = |photo: &str| folder.join(photo).to_str().unwrap().to_string();
    tab.choose("judge-files", &path(photos[0]));
    tab.until("gonogo.judged.length === 1");
    tab.drop_at("judge-drop", &path(photos[1]));
    tab.until("gonogo.judged.length === 2");
    tab.choose("judge-files", &path(photos[2]));
    tab.until("gonogo.judged.length === 3");

    for (i, native) in native.iter().enumerate() {
        let line = tab.text(&format!("gonogo.judged[{i}].split(',\"milliseconds\"')[0]"));
        assert_eq!(line, *native);
    }
    // The newest on top.
    let seen = tab.value("[...document.querySelectorAll('#judge-photos .photo .verdict')].map((v) => v.textContent)");
    assert_eq!(seen, json!(["cannot inspect", "no-go", "go"]));
    let counted = |tab: &mut Tab, what: &str| {
        tab.value(&format!("document.querySelectorAll({}).length", json!(format!("#judge-photos .photo{what}"))))
    };
    assert_eq!(counted(&mut tab, ":nth-child(3) .drawn g.good"), json!(2));
    assert_eq!(counted(&mut tab, ":nth-child(2) .drawn g.faulty path"), json!(1));
    assert_eq!(counted(&mut tab, ":nth-child(2) .strips .faulty .mark.nogo"), json!(1));
    assert_eq!(counted(&mut tab, ":nth-child(1) svg"), json!(0), "rubbish has no picture");
    assert!(!tab.text("document.title").contains("broken"));
    // What is shown is what was judged: the picture's grey values are the file's.
    let shown = tab.text("document.querySelector('#judge-photos .photo:nth-child(3) image').getAttribute('href')");
    let shown = tab.value(&format!(
        "new Promise((done) => {{ const i = new Image(); i.onload = () => {{ const c = document.createElement('canvas'); \
         c.width = i.naturalWidth; c.height = i.naturalHeight; const x = c.getContext('2d'); x.drawImage(i, 0, 0); \
         done([...x.getImageData(0, 0, c.width, c.height).data].filter((_, k) => k % 4 === 1)); }}; i.src = {}; }})",
        json!(shown)
    ));
    let file = image::open(folder.join(photos[0])).unwrap().into_luma8();
    assert!(shown == json!(file.as_raw()), "other grey values are shown");
    // Pointing at a box there points at the component in 3-D.
    tab.value("document.querySelector('#judge-photos g.faulty').dispatchEvent(new MouseEvent('mouseenter'))");
    assert_eq!(tab.value("document.querySelectorAll('.parts button.on').length"), json!(1));
    assert_eq!(tab.complaints(), Vec::<String>::new());
}

#[test]
fn what_is_no_module_of_this_version_is_refused() {
    let folder = folder("report_no_module");
    let page = judged(&folder);
    let before = fs::read(&page).unwrap();
    fs::write(folder.join("no.wasm"), b"\0asm\x01\0\0\0").unwrap();
    for (module, why) in
        [("good.png", "no WebAssembly module"), ("no.wasm", "not the runtime's"), ("none.wasm", "none.wasm")]
    {
        let mut report = Command::new(env!("CARGO_BIN_EXE_gonogo"));
        report.args(["report", "plate.gng", "--model", "plate.model.ron", "--judge", module]).current_dir(&folder);
        let output = report.output().unwrap();
        assert_eq!(output.status.code(), Some(2));
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(said.contains(why), "{said}");
    }
    assert!(fs::read(&page).unwrap() == before, "the page was written all the same");
}

#[test]
fn it_fits_a_phone() {
    let Some(name) = browser() else { return };
    let folder = folder("report_phone");
    let page = page(&root().join("tests/data/two_pins.gng"), &folder);
    let mut tab = Tab::open(name, &folder, &page, [390, 844]);
    let wide = tab.value("document.documentElement.scrollWidth");
    assert!(wide.as_u64().unwrap() <= 390, "the page is {wide} px wide");
    assert!(tab.picture().0 > 5_000);
    assert_eq!(tab.complaints(), Vec::<String>::new());
}

/// Every control has a name that can be read out.
#[test]
fn controls_have_names() {
    let Some(name) = browser() else { return };
    let folder = folder("report_names");
    let page = page(&root().join("tests/data/two_pins.gng"), &folder);
    let mut tab = Tab::open(name, &folder, &page, [1280, 900]);
    let tree = tab.call("Accessibility.getFullAXTree", json!({}));
    let asking = ["button", "slider", "checkbox", "combobox", "link", "image", "application"];
    let nameless: Vec<&Value> = tree["nodes"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|n| n["ignored"] != json!(true))
        .filter(|n| asking.iter().any(|role| n["role"]["value"] == json!(role)))
        .filter(|n| n["name"]["value"].as_str().unwrap_or_default().trim().is_empty())
        .collect();
    assert!(nameless.is_empty(), "{nameless:#?}");
}

/// The text of the page: the same every time, asking for nothing.
#[test]
fn the_same_spec_gives_the_same_page() {
    let spec = root().join("tests/data/two_pins.gng");
    let text = |name: &str| fs::read_to_string(page(&spec, &folder(name))).unwrap();
    let first = text("report_first");
    assert!(first == text("report_second"), "two runs differ");
    for asking in ["src=\"http", "href=\"http", "url(http", "@import", "//cdn"] {
        assert!(!first.contains(asking), "{asking}");
    }
}

#[test]
fn a_spec_with_an_error_has_a_page_that_says_so() {
    let folder = folder("report_faulty");
    let spec = folder.join("faulty.gng");
    fs::write(&spec, "gonogo 1\nlet a = 6 ±0.1\nlet a = 7\n").unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_gonogo"))
        .args(["report", "faulty.gng", "-o", "faulty.html"])
        .current_dir(&folder)
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(1));
    let text = fs::read_to_string(folder.join("faulty.html")).unwrap();
    assert!(text.contains("E0202") && text.contains("<mark>a</mark>"), "{text}");
}

#[test]
fn photos_without_a_model_are_refused() {
    let output = Command::new(env!("CARGO_BIN_EXE_gonogo")).args(["report", "x.gng", "photo.png"]).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("--model"));
}
