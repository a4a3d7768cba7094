//! The parts library: every size of every family is a solid of the size its standard says, at nominal, MMC and LMC.

#![cfg(feature = "compile")]

use gonogo::design::model::{Design, Part};
use gonogo::design::{library, load};
use gonogo::iso;
use gonogo::solid::{Quality, evaluate};
use gonogo::syntax::ast::{Body, Size, Stmt, Tolerance};
use gonogo::syntax::{format, parse};
use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_4, PI};

/// A table as printed: its columns, and the cells of each row by its key.
struct Table {
    param: String,
    columns: Vec<String>,
    rows: Vec<(String, Vec<Cell>)>,
}

/// The number of a cell, and the second of a pair of limits.
#[derive(Clone, Copy)]
struct Cell(f64, Option<f64>);

struct Family {
    name: String,
    file: &'static str,
    params: Vec<String>,
    tables: Vec<Table>,
}

fn families() -> Vec<Family> {
    let mut found = Vec::new();
    for (file, text) in library::files() {
        let (tree, diagnostics) = parse(text, 0);
        assert!(diagnostics.is_empty(), "{file}: {diagnostics:#?}");
        for line in tree.lines {
            if let Stmt::Family { name, params, body } = line.stmt {
                let params = params.into_iter().map(|p| p.text).collect();
                found.push(Family { name: name.text, file, params, tables: tables(&body) });
            }
        }
    }
    found
}

fn tables(body: &Body) -> Vec<Table> {
    let number = |size: &Size| match size {
        Size::Quantity(q) => q.number.value,
        other => panic!("a cell is a number: {other:?}"),
    };
    let table = |stmt: &Stmt| {
        let Stmt::Table { name, columns, body } = stmt else { return None };
        let row = |stmt: &Stmt| match stmt {
            Stmt::Row { key, cells } => {
                let cell = |dim: &gonogo::syntax::ast::Dim| match &dim.tolerance {
                    Some(Tolerance::Limits(q)) => Cell(number(&dim.size), Some(q.number.value)),
                    _ => Cell(number(&dim.size), None),
                };
                (key.text.clone(), cells.iter().map(cell).collect())
            }
            other => panic!("not a row: {other:?}"),
        };
        Some(Table {
            param: name.text.clone(),
            columns: columns.iter().map(|c| c.text.clone()).collect(),
            rows: body.lines.iter().map(|line| row(&line.stmt)).collect(),
        })
    };
    body.lines.iter().filter_map(|line| table(&line.stmt)).collect()
}

/// Every size of the first parameter in the last of the others, and every size of the others with the first of the first.
fn members(family: &Family) -> Vec<Vec<usize>> {
    let last: Vec<usize> = family.tables.iter().map(|t| t.rows.len() - 1).collect();
    let mut chosen: Vec<Vec<usize>> = Vec::new();
    for first in 0..family.tables[0].rows.len() {
        chosen.push([&[first], &last[1..]].concat());
    }
    for second in 0..family.tables.get(1).map_or(0, |t| t.rows.len()) {
        chosen.push(vec![0, second]);
    }
    chosen
}

/// A spec that places those members.
fn spec(family: &Family, chosen: &[Vec<usize>]) -> String {
    let mut text = format!("gonogo 1\nuse \"{}\"\n", family.file);
    let mut places = String::new();
    for (i, rows) in chosen.iter().enumerate() {
        let arg = |(param, (table, row)): (&String, (&Table, &usize))| {
            assert_eq!(*param, table.param);
            format!("{param} = {}", table.rows[*row].0)
        };
        let args: Vec<String> = family.params.iter().zip(family.tables.iter().zip(rows)).map(arg).collect();
        text += &format!("part p{i} = {}({})\n", family.name, args.join(", "));
        places += &format!("    place p{i} on base\n");
    }
    text + "material steel {\n    metal = steel\n}\npart base {\n    material = steel\n    add slab = box(x = 1, y = 1, z = 1)\n}\n"
        + &format!("assembly all {{\n    root base\n{places}}}\nstation s {{\n    light room = room(patches = 1)\n}}\n")
}

fn loaded(text: &str) -> Design {
    let loaded = load("x.gng", &|_| Ok(text.to_string()), &[]);
    assert!(loaded.diagnostics.is_empty(), "{:#?}", loaded.diagnostics);
    assert_eq!(loaded.inputs, ["x.gng"]);
    loaded.design.unwrap()
}

/// The values of a member's columns at one limit.
struct Values<'a> {
    design: &'a Design,
    values: &'a [f64],
    part: &'a str,
    cells: BTreeMap<&'a str, Cell>,
}

impl Values<'_> {
    fn of(&self, column: &str) -> f64 {
        let name = format!("{}.{column}", self.part);
        match self.design.dims.iter().position(|d| d.name == name) {
            Some(row) => self.values[row],
            None => self.cells[column].0,
        }
    }
}

fn disc(d: f64, h: f64) -> f64 {
    FRAC_PI_4 * d * d * h
}

fn frustum(d1: f64, d2: f64, h: f64) -> f64 {
    PI * h / 12.0 * (d1 * d1 + d1 * d2 + d2 * d2)
}

/// A cylinder with a chamfer of 45 degrees at one end.
fn chamfered(d: f64, h: f64, c: f64) -> f64 {
    disc(d, h - c) + frustum(d, d - 2.0 * c, c)
}

fn hexagon(s: f64) -> f64 {
    3f64.sqrt() / 2.0 * s * s
}

/// The volume of a member after its drawing: the same twice where there is a closed form, otherwise what it lies between.
fn volume(family: &str, v: &Values) -> [f64; 2] {
    let of = |column| v.of(column);
    let shank = |l: f64| chamfered(of("thread"), l, 0.6134 * of("pitch"));
    let exactly = |volume: f64| [volume, volume];
    // A hexagon turned down to dw at its ends lies between the cylinder dw and itself.
    let head = |h: f64| [disc(of("dw"), h), hexagon(of("s")) * h];
    let plus = |[low, high]: [f64; 2], more: f64| [low + more, high + more];
    match family {
        "iso2338" | "iso2338_h8" | "iso8734" => {
            let (d, c) = (of("size"), of("c"));
            exactly(disc(d, of("length") - 2.0 * c) + 2.0 * frustum(d, d - 0.5359 * c, c))
        }
        "iso4762" => {
            let head = chamfered(of("dk"), of("k"), of("key") / 10.0);
            exactly(head - hexagon(of("s")) * of("t") + shank(of("length")))
        }
        "iso10642" => {
            let (d, sharp, dk) = (of("key"), of("sharp"), of("dk"));
            let depth = (sharp - d) / 2.0;
            let cone = disc(dk, (sharp - dk) / 2.0) + frustum(dk, d, (dk - d) / 2.0) - hexagon(of("s")) * of("t");
            exactly(cone + shank(of("length") - depth))
        }
        "iso4017" => plus(head(of("k")), shank(of("length"))),
        "iso4014" => {
            let (l, b) = (of("l"), of("b"));
            plus(head(of("k")), disc(of("ds"), l - b) + shank(of("length") - (l - b)))
        }
        "iso4032" => {
            let (d, m, c) = (of("key"), of("m"), (of("da") - of("key")) / 2.0);
            plus(head(m), -disc(d, m - 2.0 * c) - 2.0 * frustum(d, d + 2.0 * c, c))
        }
        "iso7089" => exactly(disc(of("d2"), of("h")) - disc(of("d1"), of("h"))),
        "din625" => {
            let (bore, outer, width, r) = (of("bore"), of("outer"), of("width"), of("r"));
            // What the shields are sunk by is exact, made of the largest sizes, which are those called on the drawing.
            let (d, o, b) = (v.cells["bore"].0, v.cells["outer"].0, v.cells["width"].0);
            let rings = disc(outer, width - 2.0 * r) + 2.0 * frustum(outer, outer - 2.0 * r, r);
            let hole = disc(bore, width - 2.0 * r) + 2.0 * frustum(bore, bore + 2.0 * r, r);
            let sunk = disc(0.25 * d + 0.75 * o, 0.06 * b) - disc(0.7 * d + 0.3 * o, 0.06 * b);
            exactly(rings - hole - 2.0 * sunk)
        }
        "din6885" => {
            let (b, h, l) = (of("width"), of("height"), of("length"));
            exactly((disc(b, 1.0) + b * (l - b)) * h)
        }
        "din471" => {
            let (d, b, a, s) = (of("d2"), of("b"), of("a"), of("s"));
            let ring = |width: f64| disc(d + 2.0 * width, s) - disc(d, s);
            [ring(0.7 * b) - 2.0 * of("d5") * b * s, ring(0.8 * b) + 2.0 * disc(a, s)]
        }
        "din472" => {
            let (d, b, a, s) = (of("d2"), of("b"), of("a"), of("s"));
            let ring = |width: f64| disc(d, s) - disc(d - 2.0 * width, s);
            [ring(0.7 * b) - 2.0 * of("d5") * b * s, ring(0.8 * b) + 2.0 * disc(a, s)]
        }
        "iso3601" => exactly(PI * (of("inside") + of("tube")) * disc(of("tube"), 1.0)),
        other => panic!("no volume for `{other}`"),
    }
}

fn check(family: &Family) {
    let chosen = members(family);
    let design = loaded(&spec(family, &chosen));
    let parts: Vec<&Part> = design.parts.iter().filter(|part| part.name != "base").collect();
    assert_eq!(parts.len(), chosen.len());
    let limits = [design.nominal(), design.mmc(), design.lmc()];
    for (part, rows) in parts.into_iter().zip(&chosen) {
        let mut cells: BTreeMap<&str, Cell> = BTreeMap::new();
        for (table, row) in family.tables.iter().zip(rows) {
            let (key, row) = &table.rows[*row];
            let size = Cell(key.trim_start_matches('M').parse().unwrap(), None);
            cells.insert(if table.param == "l" { "l" } else { "key" }, size);
            cells.extend(table.columns.iter().map(String::as_str).zip(row.iter().copied()));
        }
        let mut volumes = Vec::new();
        // Lengths are swept at nominal, diameters at their limits, too.
        let limits = if rows.len() == 2 && rows[0] == 0 && rows[1] + 1 < family.tables[1].rows.len() {
            &limits[..1]
        } else {
            &limits[..]
        };
        for values in limits {
            let what = || format!("{} {} {rows:?}", family.name, part.name);
            let solid = evaluate(part, values, &Quality::default()).unwrap_or_else(|e| panic!("{}: {e:#?}", what()));
            let [low, high] =
                volume(&family.name, &Values { design: &design, values, part: &part.name, cells: cells.clone() });
            let near = 1e-9 * high;
            assert!(
                solid.volume > low - near && solid.volume < high + near,
                "{}: {} not in {low} .. {high}",
                what(),
                solid.volume
            );
            volumes.push(solid.volume);
        }
        let [nominal, mmc, lmc] = volumes[..] else { continue };
        assert!(mmc >= nominal && nominal >= lmc && mmc > lmc, "{} {}: {volumes:?}", family.name, part.name);
    }
}

macro_rules! every_size {
    ($($test:ident: $($family:literal),*;)*) => {$(
        #[test]
        fn $test() {
            let known = families();
            for name in [$($family),*] {
                check(known.iter().find(|f| f.name == name).unwrap());
            }
        }
    )*
        const TESTED: &[&str] = &[$($($family),*),*];
    };
}

every_size! {
    pins: "iso2338", "iso2338_h8", "iso8734";
    socket_screws: "iso4762";
    countersunk_screws: "iso10642";
    hexagon_bolts: "iso4014";
    hexagon_screws: "iso4017";
    nuts_and_washers: "iso4032", "iso7089";
    bearings_and_keys: "din625", "din6885";
    circlips: "din471", "din472";
    rings: "iso3601";
}

#[test]
fn every_family_is_tested_and_listed() {
    let names: Vec<String> = families().into_iter().map(|f| f.name).collect();
    let mut tested: Vec<&str> = TESTED.to_vec();
    let mut listed: Vec<&str> = library::families().map(|(name, _)| name).collect();
    let mut there: Vec<&str> = names.iter().map(String::as_str).collect();
    for list in [&mut tested, &mut listed, &mut there] {
        list.sort_unstable();
    }
    assert_eq!(tested, there);
    assert_eq!(listed, there);
}

#[test]
fn the_library_is_laid_out_and_names_its_sources() {
    for (file, text) in library::files() {
        assert_eq!(format(text).unwrap(), text, "{file}");
        assert!(file == "std/materials" || text.contains("\n// Sources. "), "{file}");
        assert!(
            file == "std/materials"
                || text.contains("Simplified: ")
                || file == "std/iso7089"
                || file == "std/iso3601"
                || file == "std/iso2338",
            "{file}"
        );
    }
}

/// The rows of the table for the first parameter.
fn rows(name: &str) -> Vec<(f64, BTreeMap<String, Cell>)> {
    let families = families();
    let table = &families.iter().find(|f| f.name == name).unwrap().tables[0];
    let row = |(key, cells): &(String, Vec<Cell>)| {
        let size = key.trim_start_matches('M').parse().unwrap();
        (size, table.columns.iter().cloned().zip(cells.iter().copied()).collect())
    };
    table.rows.iter().map(row).collect()
}

#[test]
fn sizes_grow_and_limits_are_in_order() {
    for family in families().iter().filter(|f| f.name != "din625") {
        for table in &family.tables {
            let keys: Vec<f64> = table.rows.iter().map(|(k, _)| k.trim_start_matches('M').parse().unwrap()).collect();
            assert!(keys.is_sorted() && keys.windows(2).all(|k| k[0] < k[1]), "{}", family.name);
            for (key, cells) in &table.rows {
                assert!(cells.iter().all(|c| c.0 > 0.0 && c.1.is_none_or(|high| high > c.0)), "{} {key}", family.name);
            }
            // A slip in one row would break the order of its column.
            for (column, name) in table.columns.iter().enumerate() {
                let values: Vec<f64> = table.rows.iter().map(|(_, cells)| cells[column].0).collect();
                assert!(values.is_sorted(), "{} {name}: {values:?}", family.name);
            }
        }
    }
}

#[test]
fn heads_are_larger_than_shanks_and_sockets_fit_into_them() {
    for name in ["iso4762", "iso10642"] {
        for (d, row) in rows(name) {
            let (s, t, dk) = (row["s"], row["t"], row["dk"]);
            assert!(dk.0 > 1.4 * d, "{name} M{d}");
            // Across the corners, with a wall left around it.
            assert!(s.1.unwrap() * 2.0 / 3f64.sqrt() < 0.95 * dk.0, "{name} M{d}");
            assert!(t.1.unwrap() < dk.0, "{name} M{d}");
        }
    }
    for name in ["iso4014", "iso4017", "iso4032"] {
        for (d, row) in rows(name) {
            assert!(row["s"].0 > 1.4 * d && row["dw"].0 > 1.3 * d && row["dw"].0 < row["s"].0, "{name} M{d}");
        }
    }
}

/// Coarse threads of ISO 965-1 from the formulas it rounds, in µm.
#[test]
fn threads_have_the_limits_of_6g() {
    for name in ["iso4762", "iso10642", "iso4014", "iso4017"] {
        let family = families().into_iter().find(|f| f.name == name).unwrap();
        let design = loaded(&spec(&family, &members(&family)));
        for (i, (d, row)) in rows(name).into_iter().enumerate() {
            let p = row["pitch"].0;
            let thread = design.dims.iter().find(|dim| dim.name == format!("p{i}.thread")).unwrap();
            let es = (d - thread.range.high) * 1000.0;
            let width = (thread.range.high - thread.range.low) * 1000.0;
            let formula = 180.0 * p.powf(2.0 / 3.0) - 3.15 / p.sqrt();
            assert!((width - formula).abs() < 0.06 * formula, "M{d}: {width} {formula}");
            let above = if p < 0.8 { 18.9..=22.1 } else { (13.9 + 11.0 * p)..=(16.1 + 11.0 * p) };
            assert!(above.contains(&es), "M{d}: {es}");
        }
    }
}

#[test]
fn fits_are_those_of_iso_286() {
    let known = families();
    for (name, class) in [("iso2338", "m6"), ("iso2338_h8", "h8"), ("iso8734", "m6")] {
        let family = known.iter().find(|f| f.name == name).unwrap();
        let design = loaded(&spec(family, &members(family)));
        for (i, (d, _)) in rows(name).into_iter().enumerate() {
            let size = design.dims.iter().find(|dim| dim.name == format!("p{i}.size")).unwrap();
            let [lower, upper] = iso::fit(class, d).unwrap();
            assert!((size.range.low - d - lower).abs() < 1e-12 && (size.range.high - d - upper).abs() < 1e-12);
        }
    }
    // ISO 8734, 6 m6, as every catalogue prints it.
    assert_eq!(iso::fit("m6", 6.0), Ok([0.004, 0.012]));
}

/// Bores follow from the designation: 10, 12, 15, 17, then five times its last two digits.
#[test]
fn bearings_have_the_bore_their_name_says() {
    for (number, row) in rows("din625") {
        let code = number % 100.0;
        let bore = [10.0, 12.0, 15.0, 17.0].get(code as usize).copied().unwrap_or(5.0 * code);
        assert_eq!(row["bore"].0, bore, "{number}");
        assert!(row["outer"].0 > 1.6 * bore && row["width"].0 < row["outer"].0 / 2.0, "{number}");
    }
}

/// ISO 3601-1, class B, Annex A.4.
#[test]
fn rings_have_the_tolerance_of_their_formula() {
    let family = families().into_iter().find(|f| f.name == "iso3601").unwrap();
    let design = loaded(&spec(&family, &members(&family)));
    for (i, (d, _)) in rows("iso3601").into_iter().enumerate() {
        let inside = design.dims.iter().find(|dim| dim.name == format!("p{i}.inside")).unwrap();
        assert!((inside.range.half_width() - (0.11 + 0.009 * d.powf(0.93))).abs() < 0.0051, "{d}");
    }
}
