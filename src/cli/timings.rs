//! How long the parts of judging take.
//!
//! In: the beginnings of parts, as the runtime tells them, and the end of each photo. Out: a table for people when all is
//! judged, or one object a photo for programs. Verdicts know nothing of it.

use super::args::{Global, MessageFormat};
use super::output::{self, Failure};
use crate::runtime::parts::Part;
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// Listens to an inspector.
pub struct Stopwatch {
    /// Whether anybody wants to know.
    pub is_on: bool,
    is_json: bool,
    times: Mutex<Times>,
}

struct Times {
    part: Option<Part>,
    since: Instant,
    /// Of this photo.
    spent: Spent,
    /// Of those before.
    photos: Vec<Spent>,
}

/// By part, in the order of [`Part::ALL`].
pub type Spent = [Duration; Part::ALL.len()];

impl Stopwatch {
    pub fn new(global: &Global) -> Stopwatch {
        Stopwatch {
            is_on: global.timings,
            is_json: global.message_format == MessageFormat::Json,
            times: Mutex::new(Times { part: None, since: Instant::now(), spent: Spent::default(), photos: Vec::new() }),
        }
    }

    /// To be told by the inspector.
    pub fn note(&self, part: Part) {
        if let Ok(mut times) = self.times.lock() {
            times.turn(Some(part));
        }
    }

    /// A photo, or the photos of an assembly, are judged: what it took. `None` for what could not be decoded.
    pub fn lap(&self) -> Option<Spent> {
        self.times.lock().ok()?.lap()
    }

    /// Says what a photo took where programs listen.
    pub fn tell(&self, photo: &str, spent: Option<Spent>) -> Result<(), Failure> {
        match spent {
            Some(spent) if self.is_on && self.is_json => output::line(&json(photo, &spent)),
            _ => Ok(()),
        }
    }

    /// All is judged.
    pub fn finish(&self) {
        if let (true, false, Ok(times)) = (self.is_on, self.is_json, self.times.lock()) {
            table(&times.photos).iter().for_each(|line| output::remark(line));
        }
    }
}

impl Times {
    /// Books the time since the last turn on the part that ends.
    fn turn(&mut self, next: Option<Part>) {
        let now = Instant::now();
        if let Some(part) = self.part {
            self.spent[part as usize] += now - self.since;
        }
        (self.part, self.since) = (next, now);
    }

    /// What was spent on the photo that ends here; `None` for one that could not be decoded.
    fn lap(&mut self) -> Option<Spent> {
        let judged = !matches!(self.part, None | Some(Part::Decode));
        self.turn(None);
        let spent = std::mem::take(&mut self.spent);
        judged.then(|| {
            self.photos.push(spent);
            spent
        })
    }
}

/// Least, middle and most of what photos took, by part, and each part's share of the whole.
fn table(photos: &[Spent]) -> Vec<String> {
    let whole: f64 = photos.iter().map(|spent| milliseconds(spent.iter().sum())).sum();
    let line = |name: &str, of: &dyn Fn(&Spent) -> Duration| {
        let mut all: Vec<f64> = photos.iter().map(|spent| milliseconds(of(spent))).collect();
        all.sort_by(f64::total_cmp);
        let at = |share: f64| all.get((all.len().saturating_sub(1) as f64 * share) as usize).copied().unwrap_or(0.0);
        let share = if whole > 0.0 { 100.0 * all.iter().sum::<f64>() / whole } else { 0.0 };
        format!("{name:<12} {:>9.3} {:>9.3} {:>9.3} ms {share:>4.0} %", at(0.0), at(0.5), at(1.0))
    };
    let parts = Part::ALL.iter().enumerate().map(|(i, part)| line(part.name(), &move |spent: &Spent| spent[i]));
    let head = format!("{:<12} {:>9} {:>9} {:>9}", format!("{} judged", photos.len()), "least", "middle", "most");
    [head].into_iter().chain(parts).chain([line("total", &|spent| spent.iter().sum())]).collect()
}

fn json(photo: &str, spent: &Spent) -> String {
    let part = |(part, spent): (&Part, &Duration)| serde_json::json!({ "part": part.name(), "milliseconds": milliseconds(*spent) });
    let parts: Vec<_> = Part::ALL.iter().zip(spent).map(part).collect();
    let total = milliseconds(spent.iter().sum());
    serde_json::json!({ "timings": { "photo": photo, "parts": parts, "total": total } }).to_string()
}

fn milliseconds(time: Duration) -> f64 {
    time.as_secs_f64() * 1e3
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spent(decode: u64, edges: u64) -> Spent {
        let mut spent = Spent::default();
        spent[Part::Decode as usize] = Duration::from_millis(decode);
        spent[Part::Edges as usize] = Duration::from_millis(edges);
        spent
    }

    #[test]
    fn parts_stand_at_their_numbers() {
        assert!(Part::ALL.iter().enumerate().all(|(i, part)| *part as usize == i));
    }

    #[test]
    fn a_table_has_the_middle_of_all_photos() {
        let lines = table(&[spent(1, 3), spent(1, 9), spent(4, 6)]);
        assert_eq!(lines[0], "3 judged         least    middle      most");
        assert_eq!(lines[1], "decode           1.000     1.000     4.000 ms   25 %");
        assert_eq!(lines[5], "edges            3.000     6.000     9.000 ms   75 %");
        assert_eq!(lines.last().unwrap(), "total            4.000    10.000    10.000 ms  100 %");
        assert!(table(&[])[0].starts_with("0 judged"));
    }

    #[test]
    fn an_object_has_every_part() {
        let value: serde_json::Value = serde_json::from_str(&json("a.png", &spent(2, 5))).unwrap();
        assert_eq!(value["timings"]["photo"], "a.png");
        assert_eq!(value["timings"]["parts"].as_array().unwrap().len(), Part::ALL.len());
        assert_eq!(value["timings"]["parts"][4]["part"], "edges");
        assert_eq!(value["timings"]["total"], 7.0);
    }

    #[test]
    fn what_is_no_image_is_no_photo() {
        let mut times = Times { part: None, since: Instant::now(), spent: Spent::default(), photos: Vec::new() };
        times.turn(Some(Part::Decode));
        assert!(times.lap().is_none());
        times.turn(Some(Part::Decode));
        times.turn(Some(Part::Light));
        assert!(times.lap().is_some());
        assert_eq!(times.photos.len(), 1);
    }
}
