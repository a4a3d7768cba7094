//! The page as text: whole, the same every time, and never more markup than we wrote.

use super::*;
use crate::assembly::error_tree::object_tree;
use crate::assembly::{analyse, sample};
use crate::design::model::{Material, MaterialKind};
use crate::diag::Span;
use crate::runtime::inspect::{Decision, Finding, NodeReport};
use crate::runtime::pose::Pose;
use crate::units::Range;

/// What a spiteful name looks like.
const SPITE: &str = "</script><img src=x onerror=alert(1)>\"'&";

struct Bench {
    assembly: sample::Assembly,
    analysis: crate::assembly::Analysis,
    trees: Vec<ErrorTree>,
    diagnostics: Vec<Diagnostic>,
    sources: Sources,
}

fn bench(rename: impl Fn(&mut Design)) -> Bench {
    let mut assembly = sample::pattern_wheel();
    let analysis = analyse(&assembly.design, &assembly.solids).0;
    let trees = object_tree(&assembly.design, &analysis.liaison).trees;
    assembly.design.materials = vec![steel()];
    assembly.design.parts.iter_mut().for_each(|p| p.material = 0);
    rename(&mut assembly.design);
    let sources = Sources { files: vec![(format!("{SPITE}.gng"), format!("let a = 6 {SPITE}\nlet b = 7\n"))] };
    let span = Span { file: 0, start: 4, end: 5 };
    let doubt = Diagnostic::warning("W0502", span, format!("{SPITE} can meet")).label(SPITE).note(SPITE).help(SPITE);
    Bench { assembly, analysis, trees, diagnostics: vec![doubt], sources }
}

fn steel() -> Material {
    let exactly = |v: f64| Range { low: v, nominal: v, high: v };
    Material {
        name: "steel".into(),
        kind: MaterialKind::Metal,
        n: 2.4,
        k: 4.1,
        tints: Vec::new(),
        reflectance: exactly(1.0),
        roughness: exactly(0.2),
        edge_break: exactly(0.1),
        mottle: 0.0,
        mottle_size: [1.0; 3],
        lay: None,
        span: Span::default(),
    }
}

fn verdict() -> Verdict {
    let outline = [[1.0, 1.0], [9.0, 1.0], [9.0, 9.0], [f64::NAN, 1e300]];
    let node = NodeReport {
        name: "pin".into(),
        level: 900_000,
        parent: None,
        outline,
        crossed: outline,
        score: -1.0,
        against: vec![0.0, -1.0],
        best_fault: SPITE.into(),
        inside: 1.0,
        unlike: Default::default(),
        strangeness: 0.0,
        lift: None,
        beyond: 0.0,
        faulty: true,
        explained: false,
    };
    let finding = Finding {
        component: SPITE.into(),
        fault: SPITE.into(),
        error_tree: SPITE.into(),
        node: SPITE.into(),
        p_value: 0.04,
        box_px: [0.0; 4],
    };
    Verdict {
        decision: Decision::NoGo,
        reason: SPITE.into(),
        pose: Some(Pose { x: 0.0, y: 0.0, z: 0.0, rz: 0.0 }),
        scale: 1.0,
        locator_score: 0.5,
        findings: vec![finding],
        nodes: vec![node],
        outline: Some(outline),
    }
}

fn written(bench: &Bench, model: &Model) -> String {
    judging(bench, model, None)
}

fn judging(bench: &Bench, model: &Model, judge: Option<Judge>) -> String {
    let verdict = verdict();
    let grey = image::GrayImage::new(16, 12);
    let shot = Shot { name: SPITE, grey: Some(&grey), photo: None, verdict: &verdict };
    page(&Report {
        spec: SPITE,
        diagnostics: &bench.diagnostics,
        sources: &bench.sources,
        assembly: Some(Assembly {
            design: &bench.assembly.design,
            solids: &bench.assembly.solids,
            analysis: Some(&bench.analysis),
            trees: &bench.trees,
            modes: &[],
        }),
        others: &[],
        view: None,
        model: Some(Trained { model, calibration: None, fits: false }),
        photos: &[shot],
        judge,
    })
}

fn model() -> Model {
    let mut model = crate::runtime::model::tests::tiny();
    model.nodes[0].good_scores = vec![-0.1, 0.2, 0.4];
    model.nodes[0].fault_scores = vec![-0.6, f64::NAN];
    let rate = crate::train::stats::rate(4, 10);
    let mode = |component: &str| crate::runtime::model::ModeRate {
        component: component.into(),
        fault: SPITE.into(),
        escape: rate,
    };
    model.promise.modes = vec![mode("pin"), mode(SPITE)];
    model
}

/// Start tags of the page outside scripts and styles.
fn tags(page: &str) -> Vec<&str> {
    let body = page.split_once("</style>").map_or(page, |(_, rest)| rest);
    let ends = |tag: &str| tag.find(|c: char| !c.is_ascii_alphanumeric()).unwrap_or(tag.len());
    let mut tags = Vec::new();
    let mut rest = body.split_once("<script nonce").map_or(body, |(before, _)| before);
    while let Some(at) = rest.find('<') {
        rest = &rest[at + 1..];
        tags.push(&rest[..ends(rest)]);
    }
    tags
}

#[test]
fn names_stay_text_wherever_they_stand() {
    let bench = bench(|design| {
        design.name = SPITE.into();
        design.components.iter_mut().for_each(|c| c.name = format!("{SPITE}{}", c.name));
        design.parts.iter_mut().for_each(|p| p.name = SPITE.into());
        design.materials.iter_mut().for_each(|m| m.name = SPITE.into());
    });
    let mut model = model();
    model.writer = SPITE.into();
    model.spec = SPITE.into();
    model.nodes[0].hypotheses[1].fault = SPITE.into();
    model.nodes[0].hypotheses[1].sweep = SPITE.into();
    let page = written(&bench, &model);
    assert!(!page.contains("<img src=x"), "a name became a tag");
    assert!(!page.contains("</script><img"));
    // The image tags are our own: crops of templates, with inline pictures.
    for (at, _) in page.match_indices("<img ") {
        assert!(page[at..].starts_with("<img src=\"data:image/png;base64,"), "{}", &page[at..at + 60]);
    }
    assert_eq!(page.matches("<script").count(), 3);
    let plain = written(&self::bench(|_| ()), &self::model());
    assert_eq!(tags(&page).len(), tags(&plain).len(), "names change the structure");
}

#[test]
fn the_page_is_whole_and_asks_for_nothing() {
    let page = written(&bench(|_| ()), &model());
    for id in ["assembly", "structure", "promise", "photos", "findings"] {
        assert!(page.contains(&format!("<section id=\"{id}\"")), "no section {id}");
        assert!(page.contains(&format!("href=\"#{id}\"")), "no way to {id}");
    }
    for tag in ["section", "article", "figure", "table", "tbody", "svg", "details", "button", "div", "span"] {
        let opened = tags(&page).iter().filter(|t| **t == tag).count();
        assert_eq!(opened, page.matches(&format!("</{tag}>")).count(), "<{tag}>");
    }
    assert!(page.contains("default-src 'none'"));
    for asking in ["http://", "https://"] {
        // Names of XML spaces are no addresses.
        let asked = page.match_indices(asking).filter(|(at, _)| !page[*at..].starts_with("http://www.w3.org/"));
        assert_eq!(asked.count(), 0, "{asking}");
    }
    assert!(!page.contains("NaN") || !page.contains("=\"NaN"), "a coordinate is no number");
}

#[test]
fn the_same_input_gives_the_same_bytes() {
    assert!(written(&bench(|_| ()), &model()) == written(&bench(|_| ()), &model()));
}

#[test]
fn data_can_be_read_back() {
    let bench = bench(|_| ());
    let page = written(&bench, &model());
    let data = page.split_once("id=\"data\">").unwrap().1.split_once("</script>").unwrap().0;
    let data: serde_json::Value = serde_json::from_str(data).unwrap();
    let components = data["components"].as_array().unwrap();
    assert_eq!(components.len(), bench.assembly.design.components.len());
    // Three pins of one shape share their mesh.
    assert_eq!(components[5]["mesh"], components[6]["mesh"]);
    assert_eq!(data["contacts"].as_array().unwrap().len(), bench.analysis.liaison.contacts.len());
    assert_eq!(components[0]["step"], 0);
    assert_eq!(components[2]["step"], 1, "the locking ring is put in first");
}

#[test]
fn a_page_that_judges_may_compile_its_module_and_no_more() {
    let (bench, module, mut model) = (bench(|_| ()), module::tests::whole(), model());
    let plain = written(&bench, &model);
    assert!(!plain.contains("wasm-unsafe-eval") && !plain.contains("type=\"module\""));
    model.nodes[0].name = SPITE.into();
    model.station.name = SPITE.into();
    let judge = Judge { module: Module::read(&module).unwrap(), model: SPITE, calibration: None };
    let page = judging(&bench, &model, Some(judge));
    let policy = page.split_once("Policy\" content=\"").unwrap().1.split_once('"').unwrap().0;
    let scripts = policy.split("; ").find(|p| p.starts_with("script-src")).unwrap();
    let words: Vec<&str> = scripts.split(' ').collect();
    assert!(words.len() == 3 && words[1].starts_with("'nonce-") && words[2] == "'wasm-unsafe-eval'", "{policy}");
    assert!(policy.starts_with("default-src 'none'") && !policy.contains("connect-src"));
    assert!(page.contains("<section id=\"judge\"") && page.contains("Without a calibration"));
    assert!(!page.contains("<img src=x") && !page.contains("</script><img"));
    let block =
        |id: &str| page.split_once(&format!("id=\"judge-{id}\">")).unwrap().1.split_once("</script>").unwrap().0;
    assert_eq!(block("model"), html::base64(SPITE.as_bytes()));
    assert_eq!(block("module"), html::base64(&module));
    for tag in ["section", "template", "table", "tbody", "tr", "details", "label", "div", "span"] {
        let opened = tags(&page).iter().filter(|t| **t == tag).count();
        let content = page.split_once("<script nonce").unwrap().0;
        assert_eq!(opened, content.matches(&format!("</{tag}>")).count(), "<{tag}>");
    }
}

#[test]
fn a_doubtful_promise_is_marked() {
    let page = written(&bench(|_| ()), &model());
    assert!(page.contains("W0703: hardly told") && page.contains("another version of this spec"));
    assert!(page.contains("4 of 10") && page.contains("40 %"));
}

#[test]
fn a_spec_that_cannot_be_read_still_has_a_page() {
    let sources = Sources { files: vec![("x.gng".into(), "what".into())] };
    let fault = Diagnostic::error("E0101", Span { file: 7, start: 1, end: 900 }, "no");
    let report = Report {
        spec: "x.gng",
        diagnostics: &[fault],
        sources: &sources,
        assembly: None,
        others: &[],
        view: None,
        model: None,
        photos: &[],
        judge: None,
    };
    let page = page(&report);
    assert!(page.contains("E0101") && page.contains("1</b><span>error in the spec"));
}
