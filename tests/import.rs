//! OpenSCAD designs become parts of this language that mean the same.
//!
//! The designs are as OpenSCAD 2021.01 writes them (`openscad -o x.csg x.scad`). Their volumes are closed forms; OpenSCAD's own
//! meshes with 180 facets agree with them to 1e-3.

#![cfg(feature = "compile")]

use gonogo::design::load;
use gonogo::import::openscad;
use gonogo::solid::{Quality, evaluate};
use std::f64::consts::{FRAC_PI_4, PI};

/// The volume of the part at nominal, MMC and LMC.
fn volumes(part: &str) -> [f64; 3] {
    let spec =
        format!("{part}\nassembly one {{\n    root x\n}}\nstation s {{\n    light room = room(patches = 1)\n}}\n");
    let loaded = load("x.gng", &|_| Ok(spec.clone()), &[]);
    let design = loaded.design.unwrap_or_else(|| panic!("{part}\n{:#?}", loaded.diagnostics));
    [design.nominal(), design.mmc(), design.lmc()].map(|values| {
        evaluate(&design.parts[0], &values, &Quality::default()).unwrap_or_else(|e| panic!("{part}\n{e:#?}")).volume
    })
}

fn imported(csg: &str) -> String {
    openscad(csg, "x.csg", "x").unwrap_or_else(|faults| panic!("{csg}\n{faults:#?}"))
}

/// Imports a design and holds its volume against a closed form; returns the part.
fn same_volume(csg: &str, volume: f64) -> String {
    let part = imported(csg);
    let [nominal, mmc, lmc] = volumes(&part);
    assert!((nominal - volume).abs() < 1e-5 * volume, "{nominal} is not {volume}\n{part}");
    assert!(mmc >= nominal && nominal >= lmc, "{part}");
    part
}

fn faults(csg: &str) -> Vec<(&'static str, u32, String)> {
    let faults = openscad(csg, "x.csg", "x").unwrap_err();
    faults
        .into_iter()
        .map(|d| (d.code, d.labels[0].span.start, format!("{}: {}", d.message, d.labels[0].text)))
        .collect()
}

fn matrix(rows: [[f64; 4]; 3], inner: &str) -> String {
    format!("multmatrix([{:?}, {:?}, {:?}, [0, 0, 0, 1]]) {{\n{inner}\n}}\n", rows[0], rows[1], rows[2])
}

fn moved([x, y, z]: [f64; 3], inner: &str) -> String {
    matrix([[1.0, 0.0, 0.0, x], [0.0, 1.0, 0.0, y], [0.0, 0.0, 1.0, z]], inner)
}

fn turned_z(degrees: f64, inner: &str) -> String {
    // Six digits, as OpenSCAD prints them.
    let [s, c] = [degrees.to_radians().sin(), degrees.to_radians().cos()].map(|v| (v * 1e6).round() / 1e6);
    matrix([[c, -s, 0.0, 0.0], [s, c, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]], inner)
}

fn cylinder(d: f64, h: f64) -> String {
    format!("cylinder($fn = 48, $fa = 12, $fs = 2, h = {h}, r1 = {0}, r2 = {0}, center = false);", d / 2.0)
}

fn disc(d: f64, h: f64) -> f64 {
    FRAC_PI_4 * d * d * h
}

#[test]
fn corners_that_are_only_printed_differently_are_one() {
    let hexagon = |h: f64| format!("cylinder($fn = 6, $fa = 12, $fs = 2, h = {h}, r1 = 1, r2 = 1, center = false);");
    let prism = |h: f64, points: &str| {
        format!("linear_extrude(height = {h}) {{\npolygon(points = [{points}], paths = undef);\n}}\n")
    };
    let (half, deep) = (0.75 * 3f64.sqrt(), 3f64.sqrt() / 2.0);
    // One in the other: 4e-7 mm lie between their sides.
    let six = "[1, 0], [0.5, 0.866025], [-0.5, 0.866025], [-1, 0], [-0.5, -0.866025], [0.5, -0.866025]";
    same_volume(&format!("union() {{\n{}\n{}}}", hexagon(3.0), prism(5.0, six)), 2.0 * half * 5.0);
    // Side by side in part.
    let house = "[1, 0], [0.5, 0.866025], [0.5, 2], [-0.5, 2], [-0.5, 0.866025], [-1, 0]";
    let csg = format!("union() {{\n{}{}}}", moved([0.0, 0.0, 2.0], &hexagon(3.0)), prism(5.0, house));
    same_volume(&csg, 5.0 * (half + 2.0 - deep) + 3.0 * half);
    // Through a corner; and larger, where six digits are coarser.
    for (r, corner) in [(2.0, "1.41421"), (20.0, "14.1421"), (200.0, "141.421")] {
        let octagon = format!("cylinder($fn = 8, $fa = 12, $fs = 2, h = 5, r1 = {r}, r2 = {r}, center = false);");
        let kite = prism(8.0, &format!("[{corner}, {corner}], [{r}, 0], [0, 0], [0, {r}]"));
        same_volume(&format!("difference() {{\n{octagon}\n{kite}}}"), 1.5 * 2f64.sqrt() * r * r * 5.0);
    }
    // Heights.
    let slab = moved([0.0, 0.0, 0.866_025_4], "cube(size = [9, 9, 1.73205], center = false);");
    let csg = format!("union() {{\ncube(size = [4, 4, 0.866025], center = false);\n{slab}}}");
    same_volume(&csg, 16.0 * deep + 81.0 * 2.0 * deep);
}

#[test]
fn a_plate_with_holes_reads_as_a_drawing() {
    let holes: String = [[-15.0, -6.0], [-15.0, 6.0], [15.0, -6.0], [15.0, 6.0]]
        .map(|[x, y]| moved([x, y, -5.0], &cylinder(3.0, 20.0)))
        .concat();
    let ring: String =
        (0..6).map(|i| turned_z(60.0 * f64::from(i), &moved([4.5, 0.0, -3.0], &cylinder(1.0, 20.0)))).collect();
    let post = moved([0.0, 0.0, 2.5], &cylinder(12.0, 10.0));
    let bore = moved([0.0, 0.0, -5.0], &cylinder(6.0, 40.0));
    let csg = format!(
        "difference() {{\nunion() {{\ncube(size = [40, 20, 5], center = true);\n{post}}}\ngroup() {{\n{holes}}}\n{bore}{ring}}}\n"
    );
    let part =
        same_volume(&csg, 4000.0 + disc(12.0, 10.0) - 4.0 * disc(3.0, 5.0) - disc(6.0, 15.0) - 6.0 * disc(1.0, 15.0));
    // The post stands on the block: their common plane must not tear.
    assert!(part.contains("add block  = box(x = 40, y = 20, z = 5 basic) at (0, 0, -2.5)\n"), "{part}");
    assert!(
        part.contains("cut hole   = 4x cylinder(d = 3, h = through) on grid(columns = 2, x = 30, y = 12)\n"),
        "{part}"
    );
    assert!(part.contains("cut hole_2 = cylinder(d = 6, h = through)\n"), "{part}");
    assert!(part.contains("cut hole_3 = 6x cylinder(d = 1, h = through) on circle(d = 9)\n"), "{part}");
    assert_eq!(gonogo::syntax::format(&part).unwrap(), part);
}

#[test]
fn shapes_keep_their_volume() {
    same_volume("cube(size = 3, center = false);", 27.0);
    same_volume("sphere($fn = 0, $fa = 12, $fs = 2, r = 3);", 36.0 * PI);
    let cone = "cylinder($fn = 0, $fa = 12, $fs = 2, h = 9, r1 = 1, r2 = 0, center = true);";
    same_volume(cone, 3.0 * PI);
    same_volume(&matrix([[0.0, 0.0, 1.0, 0.0], [0.0, 1.0, 0.0, 0.0], [-1.0, 0.0, 0.0, 0.0]], cone), 3.0 * PI);
    // Six facets are a hexagon.
    let nut = same_volume(
        "cylinder($fn = 6, $fa = 12, $fs = 2, h = 4, r1 = 5, r2 = 5, center = false);",
        150.0 * 3f64.sqrt(),
    );
    assert!(nut.contains("prism(outline = outline_1, h = 4)"), "{nut}");
}

#[test]
fn outlines_are_extruded_and_revolved() {
    let extrude = |inner: &str| {
        format!("linear_extrude(height = 4, center = true, convexity = 1, scale = [1, 1], $fn = 0) {{\n{inner}\n}}\n")
    };
    let polygon = "polygon(points = [[0, 0], [10, 0], [10, 5], [5, 5], [0, 5]], paths = undef, convexity = 1);";
    same_volume(&extrude(polygon), 200.0);
    let framed = "polygon(points = [[0, 0], [10, 0], [10, 8], [0, 8], [2, 2], [8, 2], [8, 6], [2, 6]], paths = [[0, 1, 2, 3], [4, 5, 6, 7]], convexity = 1);";
    same_volume(&extrude(framed), 4.0 * (80.0 - 24.0));
    same_volume(
        &extrude("difference() {\nsquare(size = [10, 8], center = true);\ncircle($fn = 0, r = 2);\n}"),
        4.0 * (80.0 - 4.0 * PI),
    );
    let rounded = "offset(r = 1, $fn = 0, $fa = 12, $fs = 2) {\nsquare(size = [3, 5], center = false);\n}";
    same_volume(&extrude(rounded), 4.0 * (15.0 + 16.0 + PI));
    let disc = |x: f64, y: f64| moved([x, y, 0.0], "circle($fn = 32, r = 2);");
    same_volume(&extrude(&format!("hull() {{\n{}{}}}", disc(0.0, 0.0), disc(6.0, 8.0))), 4.0 * (4.0 * PI + 40.0));
    let plate = format!("hull() {{\n{}{}{}{}}}", disc(0.0, 0.0), disc(20.0, 0.0), disc(20.0, 10.0), disc(0.0, 10.0));
    same_volume(&extrude(&plate), 4.0 * (200.0 + 2.0 * 60.0 + 4.0 * PI));
    let revolve = |inner: &str| format!("rotate_extrude(angle = 360, convexity = 2, $fn = 0) {{\n{inner}\n}}\n");
    same_volume(&revolve("polygon(points = [[1, 0], [3, 0], [3, 4]], paths = undef);"), 2.0 * PI * (7.0 / 3.0) * 4.0);
    let torus = same_volume(&revolve(&moved([5.0, 3.0, 0.0], "circle($fn = 0, r = 1);")), 10.0 * PI * PI);
    assert!(torus.contains("torus(d = 10, tube = 2) at (0, 0, 3)"), "{torus}");
}

#[test]
fn matrices_are_taken_apart() {
    let wedge =
        "linear_extrude(height = 3, scale = [1, 1]) {\npolygon(points = [[0, 0], [4, 0], [0, 2]], paths = undef);\n}";
    // A mirror, a scale, a turn about a slanted axis: volumes and places.
    same_volume(&matrix([[-1.0, 0.0, 0.0, 7.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]], wedge), 12.0);
    same_volume(&matrix([[2.0, 0.0, 0.0, 0.0], [0.0, 3.0, 0.0, 0.0], [0.0, 0.0, 0.5, 0.0]], wedge), 36.0);
    let (s, c) = 30f64.to_radians().sin_cos();
    let slanted = matrix([[c, s * s, s * c, 1.0], [0.0, c, -s, 2.0], [-s, s * c, c * c, 3.0]], wedge);
    let part = same_volume(&slanted, 12.0);
    assert!(part.contains("turn (30, 30, 0)"), "{part}");
    // A cube on its side needs no turn, only its sides in another order.
    let cube = matrix(
        [[0.0, 0.0, 1.0, 0.0], [0.0, 1.0, 0.0, 0.0], [-1.0, 0.0, 0.0, 0.0]],
        "cube(size = [1, 2, 3], center = false);",
    );
    let part = same_volume(&cube, 6.0);
    assert!(part.contains("box(x = 3, y = 2, z = 1) at (1.5, 1, -1)"), "{part}");
}

/// A point far off the middle tells mirrors and turns apart, which volumes do not.
#[test]
fn mirrored_and_turned_features_stand_where_they_should() {
    let hook = format!(
        "union() {{\ncube(size = [10, 2, 2], center = false);\ncube(size = [2, 6, 2], center = false);\n{}}}",
        moved([9.0, 1.0, 1.0], &cylinder(1.0, 3.0))
    );
    let mirrored = matrix([[0.0, -1.0, 0.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]], &hook);
    let part = imported(&mirrored);
    assert!(part.contains("add post    = cylinder(d = 1, h = 3) at (-1, -9, 1)"), "{part}");
    assert!(part.contains("add block   = box(x = 2 basic, y = 10 basic, z = 2 basic) at (-1, -5)"), "{part}");
}

#[test]
fn booleans_of_booleans_become_groups() {
    let tube =
        format!("difference() {{\n{}\n{}}}\n", cylinder(10.0, 5.0), moved([0.0, 0.0, -1.0], &cylinder(8.0, 9.0)));
    let csg = format!("difference() {{\ncube(size = [20, 20, 4], center = true);\n{tube}}}\n");
    let part = same_volume(&csg, 1600.0 - disc(10.0, 2.0) + disc(8.0, 2.0));
    assert!(part.contains("cut opening = group {\n"), "{part}");
    let both = format!("intersection() {{\ncube(size = [20, 20, 4], center = true);\n{}\n}}\n", cylinder(10.0, 5.0));
    assert!(same_volume(&both, disc(10.0, 2.0)).contains("keep limit = cylinder("));
    // What is shown in the background is not part of the design, and nothing cut from nothing is nothing.
    same_volume("%cube(size = 9, center = true);\n#cube(size = 2, center = true);\ngroup();\n", 8.0);
    assert_eq!(faults("difference() {\ngroup();\ncube(size = 2, center = true);\n}\n")[0].0, "E0903");
}

#[test]
fn bodies_that_stand_apart_are_parts_of_their_own() {
    let three: String = [0.0, 20.0, 3.0].map(|x| moved([x, 0.0, 0.0], &cylinder(4.0, 5.0))).concat();
    let part = imported(&three);
    assert!(part.contains("part x_1 {") && part.contains("part x_2 {") && !part.contains("part x_3"), "{part}");
    assert!(part.contains("2x cylinder(d = 4, h = 5) on line(pitch = 3)"), "{part}");
}

/// Copies share a size, so their tops stay level; where they stand side by side it is what keeps them together.
#[test]
fn sizes_that_keep_copies_together_are_exact() {
    let row: String = [0.0, 2.0, 4.0].map(|x| moved([x, 0.0, 0.0], "cube(size = [2, 3, 4], center = false);")).concat();
    let part = same_volume(&row, 72.0);
    assert!(part.contains("3x box(x = 2 basic, y = 3, z = 4) at (1, 1.5) on line(pitch = 2)"), "{part}");
}

#[test]
fn what_has_no_counterpart_is_named_with_its_place() {
    let csg = "cube(size = 2, center = true);\nhull() {\ncube(size = 1);\nsphere(r = 1);\n}\ntext(text = \"a \\\"b\\\"\");\npolyhedron(points = [], faces = []);\n";
    let found = faults(csg);
    assert_eq!(found.iter().map(|f| f.0).collect::<Vec<_>>(), ["E0902"; 3]);
    for ((_, at, message), word) in found.iter().zip(["hull", "text", "polyhedron"]) {
        assert!(csg[*at as usize..].starts_with(word), "{message}");
        assert!(message.starts_with(&format!("`{word}` has no counterpart")), "{message}");
    }
    let sheared = matrix([[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.4, 0.0], [0.0, 0.0, 1.0, 0.0]], "cube(size = 1);");
    assert!(faults(&sheared)[0].2.contains("sheared"));
    let oval = matrix([[2.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]], &cylinder(4.0, 1.0));
    assert!(faults(&oval)[0].2.contains("ellipse"));
    assert!(faults("linear_extrude(height = 4, twist = 90) {\nsquare(size = 1);\n}")[0].2.contains("twist"));
    assert!(faults("circle(r = 2);")[0].2.contains("flat"));
}

#[test]
fn texts_that_are_no_designs_are_refused_where_they_go_wrong() {
    for (text, at) in [
        ("cube(size = [1, 2", 17),
        ("cube(size = 1)", 14),
        ("x = 3;", 2),
        ("cube(size = foo);", 12),
        ("cube(1); }", 9),
        ("text(text = \"", 12),
    ] {
        let found = faults(text);
        assert_eq!((found[0].0, found[0].1), ("E0901", at), "{text}: {}", found[0].2);
    }
    assert_eq!(faults(&"group() {".repeat(5000))[0].0, "E0901");
    assert_eq!(faults("cube(size = [")[0].0, "E0901");
    assert_eq!(faults("")[0].0, "E0903");
    assert_eq!(openscad("cube(size = 1);", "x.csg", "on").unwrap_err()[0].code, "E0903");
}

/// Three boxes of which two are turned about a corner that all have in common, as in OpenSCAD's own example of `rotate`; once as
/// newer versions print it, and once with six digits. Their places have to be as exact as their angles: corners that lie
/// 3e-6 mm from each other are neither one corner nor two.
#[test]
fn corners_that_coincide_in_the_design_coincide_in_the_part() {
    let cube = "cube(size = [1, 2, 3], center = false);\n";
    // Turned by 45 deg about x, then y, then z, in 16 digits.
    let sixteen = "multmatrix([[0.5000000000000001, -0.14644660940672627, 0.853553390593274, 0], [0.5000000000000001, 0.853553390593274, -0.14644660940672627, 0], [-0.7071067811865476, 0.5000000000000001, 0.5000000000000001, 0], [0, 0, 0, 1]])";
    let six = "multmatrix([[0.5, -0.146447, 0.853553, 0], [0.5, 0.853553, -0.146447, 0], [-0.707107, 0.5, 0.5, 0], [0, 0, 0, 1]])";
    let quarter = "multmatrix([[0.7071067811865476, -0.7071067811865476, 0, 0], [0.7071067811865476, 0.7071067811865476, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])";
    let of = |turn: &str, about_z: &str| {
        let inner = format!("{turn} {{\n{cube}}}\n{cube}{about_z} {{\n{cube}}}\n");
        volumes(&imported(&moved([-6.0, 0.0, 0.0], &inner)))[0]
    };
    let exact = of(sixteen, quarter);
    assert!((6.0..18.0).contains(&exact), "{exact}");
    let printed = of(six, &quarter.replace("0.7071067811865476", "0.707107"));
    assert!((printed - exact).abs() < 1e-6 * exact, "{printed} {exact}");
    // Two of them share a wedge of 45 deg along their common edge: 18 less what they overlap, by integration over the wedge.
    let two =
        |about_z: &str| volumes(&imported(&moved([-6.0, 0.0, 0.0], &format!("{cube}{about_z} {{\n{cube}}}\n"))))[0];
    let common = 3.0 * wedge();
    assert!((two(quarter) - (12.0 - common)).abs() < 1e-6, "{} {common}", two(quarter));
}

/// Area that the rectangle 1 × 2 and the same turned by 45° to the left about its corner have in common.
fn wedge() -> f64 {
    // Clip one by the four sides of the other.
    let (s, c) = FRAC_PI_4.sin_cos();
    let turned = |[x, y]: [f64; 2]| [c * x - s * y, s * x + c * y];
    let mut area: Vec<[f64; 2]> = vec![[0.0, 0.0], [1.0, 0.0], [1.0, 2.0], [0.0, 2.0]];
    let other: Vec<[f64; 2]> = area.iter().map(|p| turned(*p)).collect();
    for i in 0..4 {
        let (a, b) = (other[i], other[(i + 1) % 4]);
        let side = |p: [f64; 2]| (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
        let mut kept = Vec::new();
        for k in 0..area.len() {
            let (p, q) = (area[k], area[(k + 1) % area.len()]);
            let (u, v) = (side(p), side(q));
            if u >= 0.0 {
                kept.push(p);
            }
            if (u < 0.0) != (v < 0.0) {
                kept.push([0, 1].map(|i| p[i] + (q[i] - p[i]) * u / (u - v)));
            }
        }
        area = kept;
    }
    let cross = |k: usize| area[k][0] * area[(k + 1) % area.len()][1] - area[k][1] * area[(k + 1) % area.len()][0];
    (0..area.len()).map(cross).sum::<f64>() / 2.0
}

#[test]
fn what_reaches_to_the_stars_is_refused() {
    let far = moved([0.0, 0.0, 1e300], "cube(size = [1, 1, 1], center = true);");
    let wide = "linear_extrude(height = 1) {\npolygon(points = [[0, 0], [5, 0], [5, 1e308]], paths = undef);\n}\n";
    let large = "sphere($fn = 99, $fa = 12, $fs = 2, r = 3e200);";
    for (csg, node) in [(far.as_str(), "cube"), (wide, "polygon"), (large, "sphere")] {
        let found = faults(csg);
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(found[0].0 == "E0902" && found[0].2.contains(&format!("`{node}`")), "{found:?}");
    }
}
