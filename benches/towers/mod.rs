//! A generated assembly of any size: towers of equal plates on a base, with pins through all plates of a tower.

use gonogo::assembly::piece::Workshop;
use gonogo::design::load;
use gonogo::design::model::Design;
use gonogo::solid::{Quality, Solid};
use std::fmt::Write;
use std::sync::Arc;

/// How much of everything: towers in a row, plates in a tower, columns and rows of pins in a tower.
#[derive(Debug, Clone, Copy)]
pub struct Size {
    pub towers: usize,
    pub plates: usize,
    pub columns: usize,
    pub rows: usize,
}

impl Size {
    #[allow(dead_code, reason = "the bench asks for contacts only")]
    pub fn components(self) -> usize {
        1 + self.towers * (self.plates + self.pins())
    }

    /// Pins in their holes, pins on the base, and plates on each other and on the base.
    pub fn contacts(self) -> usize {
        self.towers * (self.pins() * (self.plates + 1) + self.plates)
    }

    fn pins(self) -> usize {
        self.columns * self.rows
    }
}

/// The spec of such an assembly: plates 5 mm thick, pins of 4 g6 in holes of 4 H7 every 10 mm.
pub fn spec(size: Size) -> String {
    let Size { towers, plates, columns, rows } = size;
    let (x, y) = (10 * columns + 10, 10 * rows + 10);
    let mut text = String::from("gonogo 1\nunits mm deg\ntolerances exact\nmaterial steel { metal = steel }\n");
    let parts = format!(
        "part base {{\n    material = steel\n    add slab = box(x = {}, y = {y}, z = 10)\n}}\n\
         part plate {{\n    material = steel\n    add slab = box(x = {x}, y = {y}, z = 5)\n    \
         cut hole = {}x cylinder(d = 4 H7, h = through) on grid(columns = {columns}, x = 10, y = 10)\n}}\n\
         part pin {{\n    material = steel\n    add shank = cylinder(d = 4 g6, h = {})\n}}\n\
         assembly towers {{\n    root base\n",
        towers * (x + 10),
        columns * rows,
        5 * plates + 3,
    );
    text.push_str(&parts);
    for t in 0..towers {
        let at = (2 * t + 1) as f64 * (x + 10) as f64 / 2.0 - (towers * (x + 10)) as f64 / 2.0;
        for p in 0..plates {
            let _ = writeln!(
                text,
                "    place plate_{t}_{p} = plate on base {{\n        x = {at}\n        z = {}\n    }}",
                10 + 5 * p
            );
        }
        let _ = writeln!(text, "    place pin_{t} = {}x pin on plate_{t}_0.hole", columns * rows);
    }
    text.push_str("}\nstation bench {\n    light room = room()\n}\n");
    text
}

/// The design, and one nominal solid per component.
pub fn build(size: Size) -> (Design, Vec<Arc<Solid>>) {
    let text = spec(size);
    let loaded = load("towers.gng", &|_| Ok(text.clone()), &[]);
    let design = loaded.design.unwrap_or_else(|| panic!("{:?}", loaded.diagnostics));
    let (nominal, mut workshop) = (design.nominal(), Workshop::default());
    let mut solid = |c: usize| workshop.solid(&design.parts[design.components[c].part], &nominal, &Quality::default());
    let solids = (0..design.components.len()).map(|c| solid(c).unwrap_or_else(|d| panic!("{d:?}"))).collect();
    assert_eq!(workshop.made(), 3, "copies that are alike are one solid");
    (design, solids)
}
