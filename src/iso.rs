//! Standard tolerances: ISO 286 fits and ISO 2768 general tolerances.
//!
//! In: a size in mm and a class. Out: limit deviations in mm. The tables hold the rounded values of ISO 286-1:2010 and
//! ISO 2768-1:1989 in whole micrometres, as handbooks print them; a test holds those of ISO 286 against the formulas
//! the standard derived them from. Knows no part and no unit but the millimetre.

/// Upper limits (mm, inclusive) of the steps of nominal sizes.
const STEPS: [f64; 13] = [3.0, 6.0, 10.0, 18.0, 30.0, 50.0, 80.0, 120.0, 180.0, 250.0, 315.0, 400.0, 500.0];

/// The largest size the fits are tabulated for (mm).
pub const LARGEST: f64 = STEPS[STEPS.len() - 1];

/// First grade of [`GRADES`].
const FIRST_GRADE: u32 = 4;

/// First grade beyond [`GRADES`], and the last there is here.
const FIRST_COARSE: u32 = 13;
const LAST_GRADE: u32 = 17;

/// Standard tolerances IT4 to IT12 in µm, a row per grade and a column per step.
const GRADES: [[u16; 13]; 9] = [
    [3, 4, 4, 5, 6, 7, 8, 10, 12, 14, 16, 18, 20],
    [4, 5, 6, 8, 9, 11, 13, 15, 18, 20, 23, 25, 27],
    [6, 8, 9, 11, 13, 16, 19, 22, 25, 29, 32, 36, 40],
    [10, 12, 15, 18, 21, 25, 30, 35, 40, 46, 52, 57, 63],
    [14, 18, 22, 27, 33, 39, 46, 54, 63, 72, 81, 89, 97],
    [25, 30, 36, 43, 52, 62, 74, 87, 100, 115, 130, 140, 155],
    [40, 48, 58, 70, 84, 100, 120, 140, 160, 185, 210, 230, 250],
    [60, 75, 90, 110, 130, 160, 190, 220, 250, 290, 320, 360, 400],
    [100, 120, 150, 180, 210, 250, 300, 350, 400, 460, 520, 570, 630],
];

/// Distance of a shaft's tolerance zone from zero in µm: below it for d to g, above it for m to p.
const D: [u16; 13] = [20, 30, 40, 50, 65, 80, 100, 120, 145, 170, 190, 210, 230];
const E: [u16; 13] = [14, 20, 25, 32, 40, 50, 60, 72, 85, 100, 110, 125, 135];
const F: [u16; 13] = [6, 10, 13, 16, 20, 25, 30, 36, 43, 50, 56, 62, 68];
const G: [u16; 13] = [2, 4, 5, 6, 7, 9, 10, 12, 14, 15, 17, 18, 20];
/// k of the grades 4 to 7; it is 0 in the others.
const K: [u16; 13] = [0, 1, 1, 1, 2, 2, 2, 3, 3, 4, 4, 4, 5];
const M: [u16; 13] = [2, 4, 6, 7, 8, 9, 11, 13, 15, 17, 20, 21, 23];
const N: [u16; 13] = [4, 8, 10, 12, 15, 17, 20, 23, 27, 31, 34, 37, 40];
const P: [u16; 13] = [6, 12, 15, 18, 22, 26, 32, 37, 43, 50, 56, 62, 68];

/// Why a class has no deviations.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FitError {
    /// Not a class of the tables.
    UnknownClass,
    /// The size lies outside the tables.
    OutsideTable,
}

/// True for the class of a hole (`H7`), false for that of a shaft (`g6`).
pub fn is_hole_class(class: &str) -> bool {
    class.starts_with(|c: char| c.is_ascii_uppercase())
}

/// Lower and upper deviation in mm of `class` (`H7`, `g6`, `js7`) at a nominal size in mm.
///
/// Covers d to h, js, k, m, n, p and their holes in the grades 4 to 17, over 0 mm up to [`LARGEST`].
pub fn fit(class: &str, size: f64) -> Result<[f64; 2], FitError> {
    let digits = class.find(|c: char| c.is_ascii_digit()).ok_or(FitError::UnknownClass)?;
    let (letter, grade) = (&class[..digits], class[digits..].parse().map_err(|_| FitError::UnknownClass)?);
    let shaft_letter = letter.to_ascii_lowercase();
    if !["d", "e", "f", "g", "h", "js", "k", "m", "n", "p"].contains(&shaft_letter.as_str()) || is_mixed_case(letter) {
        return Err(FitError::UnknownClass);
    }
    let tolerance = |grade| standard_tolerance(grade, size);
    let width = tolerance(grade)?;
    let step = step(size).ok_or(FitError::OutsideTable)?;
    let [lower, upper] = shaft_zone(&shaft_letter, grade, step, width);
    if !is_hole_class(letter) {
        return Ok([lower, upper].map(millimetres));
    }
    // Holes mirror the shaft; for K, M, N up to IT8 and P up to IT7 the standard shifts them by the difference to the
    // next finer grade, so that a hole with the shaft one grade finer keeps the fit of the basic hole.
    let shifted = match shaft_letter.as_str() {
        "k" | "m" | "n" => grade <= 8,
        "p" => grade <= 7,
        _ => false,
    };
    let shift = if shifted && step > 0 && grade > FIRST_GRADE { width - tolerance(grade - 1)? } else { 0 };
    // From IT9 on, K and N end at zero.
    let coarse = grade > 8 && matches!(shaft_letter.as_str(), "k" | "n");
    let mirrored = if coarse { [-width, 0] } else { [-upper + shift, -lower + shift] };
    Ok(hole_of_own_width(mirrored, &shaft_letter, width).map(millimetres))
}

fn is_mixed_case(letter: &str) -> bool {
    letter.len() > 1 && letter != "JS" && letter != "js"
}

/// The zone keeps its width when k mirrors, whose shaft deviation depends on the grade.
fn hole_of_own_width([lower, upper]: [i32; 2], letter: &str, width: i32) -> [i32; 2] {
    match letter {
        "d" | "e" | "f" | "g" | "h" => [lower, lower + width],
        _ => [upper - width, upper],
    }
}

/// Lower and upper deviation of a shaft in µm. `js` of an odd width keeps the half micrometre out of the integers by
/// rounding it down, as the tables do.
fn shaft_zone(letter: &str, grade: u32, step: usize, width: i32) -> [i32; 2] {
    let below = |table: [u16; 13]| [-i32::from(table[step]) - width, -i32::from(table[step])];
    let above = |table: [u16; 13]| [i32::from(table[step]), i32::from(table[step]) + width];
    match letter {
        "d" => below(D),
        "e" => below(E),
        "f" => below(F),
        "g" => below(G),
        "js" => [-(width / 2), width / 2],
        "k" if (4..=7).contains(&grade) => above(K),
        "k" => [0, width],
        "m" => above(M),
        "n" => above(N),
        "p" => above(P),
        _ => [-width, 0],
    }
}

/// Width of the tolerance zone of a grade in µm. From IT13 on it is ten times that of the grade five finer.
fn standard_tolerance(grade: u32, size: f64) -> Result<i32, FitError> {
    if (FIRST_COARSE..=LAST_GRADE).contains(&grade) {
        return Ok(10 * standard_tolerance(grade - 5, size)?);
    }
    let row = grade.checked_sub(FIRST_GRADE).and_then(|i| GRADES.get(i as usize)).ok_or(FitError::UnknownClass)?;
    Ok(i32::from(row[step(size).ok_or(FitError::OutsideTable)?]))
}

fn step(size: f64) -> Option<usize> {
    (size > 0.0).then(|| STEPS.iter().position(|&limit| size <= limit)).flatten()
}

fn millimetres(micrometres: i32) -> f64 {
    f64::from(micrometres) / 1000.0
}

/// Class of general tolerances after ISO 2768-1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum General {
    Fine,
    Medium,
    Coarse,
    VeryCoarse,
}

impl General {
    /// From the name in the title block: `ISO2768-m`.
    pub fn from_name(name: &str) -> Option<General> {
        Some(match name.strip_prefix("ISO2768-")? {
            "f" => General::Fine,
            "m" => General::Medium,
            "c" => General::Coarse,
            "v" => General::VeryCoarse,
            _ => return None,
        })
    }
}

/// Permissible deviation ± in mm of a linear size in mm; `None` outside 0.5 to 4000 mm and where the standard has none.
pub fn general_linear(class: General, size: f64) -> Option<f64> {
    const LIMITS: [f64; 8] = [3.0, 6.0, 30.0, 120.0, 400.0, 1000.0, 2000.0, 4000.0];
    // Hundredths of a millimetre; 0 where the standard gives no value.
    const TABLE: [[u16; 8]; 4] = [
        [5, 5, 10, 15, 20, 30, 50, 0],
        [10, 10, 20, 30, 50, 80, 120, 200],
        [20, 30, 50, 80, 120, 200, 300, 400],
        [0, 50, 100, 150, 250, 400, 600, 800],
    ];
    const SMALLEST: f64 = 0.5;
    let column = LIMITS.iter().position(|&limit| size <= limit)?;
    let deviation = TABLE[class as usize][column];
    (size >= SMALLEST && deviation > 0).then(|| f64::from(deviation) / 100.0)
}

/// Permissible deviation ± in mm of a broken edge: the radius of a rounded corner or the height of a chamfer, in mm. `None`
/// below 0.5 mm, where the standard wants it stated.
pub fn general_edge(class: General, size: f64) -> Option<f64> {
    const LIMITS: [f64; 2] = [3.0, 6.0];
    const FINE: [f64; 3] = [0.2, 0.5, 1.0];
    const COARSE: [f64; 3] = [0.4, 1.0, 2.0];
    const SMALLEST: f64 = 0.5;
    let row = if matches!(class, General::Fine | General::Medium) { FINE } else { COARSE };
    let column = LIMITS.iter().position(|&limit| size <= limit).unwrap_or(LIMITS.len());
    (size >= SMALLEST).then_some(row[column])
}

/// Permissible deviation ± in rad of an angle whose shorter leg is `leg` mm long.
pub fn general_angular(class: General, leg: f64) -> f64 {
    const LIMITS: [f64; 4] = [10.0, 50.0, 120.0, 400.0];
    // Minutes of arc.
    const FINE: [u16; 5] = [60, 30, 20, 10, 5];
    const COARSE: [u16; 5] = [90, 60, 30, 15, 10];
    const VERY_COARSE: [u16; 5] = [180, 120, 60, 30, 20];
    let row = match class {
        General::Fine | General::Medium => FINE,
        General::Coarse => COARSE,
        General::VeryCoarse => VERY_COARSE,
    };
    let column = LIMITS.iter().position(|&limit| leg <= limit).unwrap_or(LIMITS.len());
    (f64::from(row[column]) / 60.0).to_radians()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn microns(class: &str, size: f64) -> [i32; 2] {
        fit(class, size).unwrap().map(|mm| (mm * 1000.0).round() as i32)
    }

    #[test]
    fn published_values() {
        let published = [
            ("H7", 50.0, [0, 25]),
            ("g6", 50.0, [-25, -9]),
            ("f7", 25.0, [-41, -20]),
            ("g6", 10.0, [-14, -5]),
            ("g6", 100.0, [-34, -12]),
            ("h6", 20.0, [-13, 0]),
            ("k6", 20.0, [2, 15]),
            ("n6", 20.0, [15, 28]),
            ("p6", 20.0, [22, 35]),
            ("K7", 20.0, [-15, 6]),
            ("N7", 20.0, [-28, -7]),
            ("P7", 20.0, [-35, -14]),
            ("N9", 20.0, [-52, 0]),
            ("F7", 20.0, [20, 41]),
            ("js6", 20.0, [-6, 6]),
            ("h13", 10.0, [-220, 0]),
            ("h14", 50.0, [-620, 0]),
            ("js15", 20.0, [-420, 420]),
            ("js15", 100.0, [-700, 700]),
            ("h16", 120.0, [-2200, 0]),
            ("js17", 260.0, [-2600, 2600]),
        ];
        for (class, size, deviations) in published {
            assert_eq!(microns(class, size), deviations, "{size} {class}");
        }
    }

    #[test]
    fn limits_of_a_step_belong_to_it() {
        assert_eq!(microns("H7", 3.0), [0, 10]);
        assert_eq!(microns("H7", 3.001), [0, 12]);
        assert_eq!(fit("H7", 500.1), Err(FitError::OutsideTable));
        assert_eq!(fit("H7", 0.0), Err(FitError::OutsideTable));
    }

    #[test]
    fn unknown_classes_are_refused() {
        for class in ["H73", "h18", "H0", "H", "x7", "Js7", "", "H99999999999"] {
            assert_eq!(fit(class, 10.0), Err(FitError::UnknownClass), "{class}");
        }
    }

    /// ISO 286-1 derives its tables from i = 0.45 ∛D + 0.001 D (µm) at the geometric mean D of each step, and rounds.
    #[test]
    fn tables_agree_with_the_formulas_of_the_standard() {
        let mut low = 1.0_f64;
        for (step, &high) in STEPS.iter().enumerate() {
            // Several steps are means of finer ones, and the rounding of the standard is coarse: 15 % and 1 µm cover it.
            let near = |table: u16, formula: f64, what: &str| {
                assert!(
                    (f64::from(table) - formula).abs() <= 1.0 + 0.15 * formula,
                    "{what} up to {high}: {table} {formula}"
                );
            };
            let mean = (low * high).sqrt();
            let unit = 0.45 * mean.cbrt() + 0.001 * mean;
            for (row, factor) in GRADES[1..].iter().zip([7.0, 10.0, 16.0, 25.0, 40.0, 64.0, 100.0, 160.0]) {
                near(row[step], factor * unit, "IT");
            }
            near(D[step], 16.0 * mean.powf(0.44), "d");
            near(E[step], 11.0 * mean.powf(0.41), "e");
            near(F[step], 5.5 * mean.powf(0.41), "f");
            near(G[step], 2.5 * mean.powf(0.34), "g");
            near(K[step], 0.6 * mean.cbrt(), "k");
            // Up to 3 mm the standard sets m, n and p closer to zero than its formulas.
            if step > 0 {
                near(M[step], f64::from(GRADES[3][step] - GRADES[2][step]), "m");
                near(N[step], 5.0 * mean.powf(0.34), "n");
                near(P[step], f64::from(GRADES[3][step]) + 2.5, "p");
            }
            low = high;
        }
    }

    #[test]
    fn general_tolerances_of_the_standard() {
        assert_eq!(general_linear(General::Medium, 50.0), Some(0.3));
        assert_eq!(general_linear(General::Fine, 6.0), Some(0.05));
        assert_eq!(general_linear(General::VeryCoarse, 2.0), None);
        assert_eq!(general_linear(General::Medium, 0.4), None);
        assert_eq!(general_edge(General::Medium, 1.0), Some(0.2));
        assert_eq!(general_edge(General::Coarse, 8.0), Some(2.0));
        assert_eq!(general_edge(General::Fine, 0.4), None);
        assert!((general_angular(General::Medium, 8.0) - 1f64.to_radians()).abs() < 1e-12);
        assert!((general_angular(General::Coarse, 80.0) - 0.5f64.to_radians()).abs() < 1e-12);
    }
}
