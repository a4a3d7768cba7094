//! `calibrate` and `inspect` for a station with several cameras: photos come as `top=PHOTO side=PHOTO`.
//!
//! In: a rig, photos by camera from files and folders. Out: one verdict an assembly. Photos of one assembly are paired in the
//! order given, those of folders by their names; what has no partner is refused before anything is judged.

use super::args::{Calibrate, Global, Inspect, VerdictFormat};
use super::judge::{self, Overlays, coded, exit_of};
use super::output::{self, DASH, Failure};
use super::photos::{self, End, Watch};
use super::timings::Stopwatch;
use super::verdict::{self, Outcome};
use super::{Exit, compile};
use crate::diag::suggest::nearest;
use crate::runtime::joint::{self, RigInspector, RigOutcome};
use crate::runtime::photo::{Photo, PhotoError};
use crate::runtime::rig::{Rig, RigCalibration};
use std::collections::BTreeMap;
use std::ffi::{OsStr, OsString};
use std::io;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// What the rig promises, in a few lines.
pub fn summarise(rig: &Rig, path: &Path) -> Result<(), Failure> {
    let cameras = rig.names().join(", ");
    let count = rig.components.len();
    output::line(&format!("{}: station {}, cameras {cameras}, {count} components", path.display(), rig.rig))?;
    compile::promised(&rig.promise)
}

/// Fits every camera of a rig to its station.
pub fn calibrate(args: &Calibrate, text: &str) -> Result<Exit, Failure> {
    let rig = read(&args.model, text)?;
    output::probe(&args.output)?;
    let assemblies = assemblies(&rig, &args.photos)?;
    let decode = |photos: &Vec<PathBuf>| -> Result<Vec<Photo>, Failure> {
        photos.iter().zip(&rig.cameras).map(|(path, model)| judge::photo(path, model)).collect()
    };
    let photos = assemblies.iter().map(decode).collect::<Result<Vec<_>, Failure>>()?;
    match joint::calibrate(&rig, &photos) {
        Ok(calibration) => {
            joint::doubts(&rig, &calibration, &photos).unwrap_or_default().iter().for_each(judge::warn_of);
            output::write(&args.output, calibration.write().as_bytes())?;
            Ok(Exit::Fine)
        }
        Err(refusal) => {
            output::remark(&coded(&refusal.to_string()));
            Ok(Exit::Faults)
        }
    }
}

/// Judges assemblies one after the other. A photo that cannot be read makes a verdict of its own and stops nothing.
pub fn inspect(args: &Inspect, text: &str, global: &Global) -> Result<Exit, Failure> {
    let rig = read(&args.model, text)?;
    let calibration = calibration(args.calibration.as_deref(), &rig)?;
    let listed = assemblies(&rig, &args.photos)?;
    let overlays = args.overlay.as_deref().map(|dir| overlays(dir, &rig, &listed)).transpose()?;
    let watched = |dir: &Path| rig.names().into_iter().map(|name| Watch::new(&dir.join(name))).collect();
    let watches: Option<Vec<Watch>> = args.watch.as_deref().map(watched).transpose()?;
    let unusable = || Failure("E0803: a camera cannot see the nodes of its model: compile the spec again".into());
    let stopwatch = Stopwatch::new(global);
    let listener = |part| stopwatch.note(part);
    let mut inspector = RigInspector::new(&rig, &calibration).ok_or_else(unusable)?;
    if stopwatch.is_on {
        inspector = inspector.heard_by(&listener);
    }
    let stopwatch = &stopwatch;
    let mut desk = Desk { inspector, stopwatch, format: args.format, overlays, outcomes: Vec::new(), worst: None };
    for photos in &listed {
        desk.take(photos, photos.iter().map(|path| output::read_file(path)).collect())?;
    }
    if let Some(mut watches) = watches {
        let end = End { after: args.for_count, once_there: args.until.as_deref() };
        Watch::run_together(&mut watches, &end, |photos, patient| desk.take_if_complete(photos, patient))?;
    }
    if args.format == VerdictFormat::Junit {
        let name = format!("{}.{}", rig.assembly, rig.rig);
        let components: Vec<String> = rig.components.iter().map(|c| c.name.clone()).collect();
        output::line(&verdict::junit(&name, &components, &desk.outcomes))?;
    }
    stopwatch.finish();
    Ok(desk.worst.unwrap_or(Exit::Trouble))
}

fn read(path: &Path, text: &str) -> Result<Rig, Failure> {
    Rig::read(text).map_err(|e| Failure(format!("`{}`: {e}", path.display())))
}

fn calibration(path: Option<&Path>, rig: &Rig) -> Result<RigCalibration, Failure> {
    let Some(path) = path else {
        judge::warn_uncalibrated(&example(rig));
        return Ok(RigCalibration::nominal(rig));
    };
    let text = output::read_text(path)?;
    RigCalibration::read(&text, rig).map_err(|e| Failure(format!("`{}`: {e}", path.display())))
}

/// `top=PHOTO side=PHOTO`
fn example(rig: &Rig) -> String {
    rig.names().iter().map(|name| format!("{name}=PHOTO")).collect::<Vec<_>>().join(" ")
}

/// A folder a camera.
fn overlays(dir: &Path, rig: &Rig, listed: &[Vec<PathBuf>]) -> Result<Vec<Overlays>, Failure> {
    output::make_dir(dir)?;
    let of = |(camera, name): (usize, &str)| {
        let photos: Vec<PathBuf> = listed.iter().map(|photos| photos[camera].clone()).collect();
        Overlays::new(&dir.join(name), &photos)
    };
    rig.names().into_iter().enumerate().map(of).collect()
}

/// The photos of each assembly, in the order of the cameras.
fn assemblies(rig: &Rig, named: &[PathBuf]) -> Result<Vec<Vec<PathBuf>>, Failure> {
    let names = rig.names();
    let mut given: Vec<Vec<PathBuf>> = vec![Vec::new(); names.len()];
    for path in named {
        for (camera, path) in by_camera(rig, path)? {
            given[camera].push(path);
        }
    }
    let counts: Vec<usize> = given.iter().map(Vec::len).collect();
    if counts.iter().any(|&count| count != counts[0]) {
        let each = names.iter().zip(&counts).map(|(name, count)| format!("{count} of `{name}`"));
        let each: Vec<String> = each.collect();
        return Err(Failure(format!(
            "every assembly needs a photo of each camera, but there are {}",
            each.join(" and ")
        )));
    }
    let mut all = Vec::new();
    for round in 0..counts[0] {
        let photos: Vec<PathBuf> = given.iter().map(|paths| paths[round].clone()).collect();
        match photos.iter().filter(|path| path.is_dir()).count() {
            0 => all.push(photos),
            folders if folders == photos.len() => all.extend(in_folders(&photos)?),
            _ => {
                let mixed: Vec<String> = photos.iter().map(|p| format!("`{}`", p.display())).collect();
                return Err(Failure(format!("{} are a folder and a photo: name one kind", mixed.join(" and "))));
            }
        }
    }
    Ok(all)
}

/// `top=PHOTO`, or a folder with a folder for each camera.
fn by_camera(rig: &Rig, path: &Path) -> Result<Vec<(usize, PathBuf)>, Failure> {
    let names = rig.names();
    let split = path.to_str().and_then(|text| text.split_once('='));
    if let Some((camera, photo)) = split {
        if let Some(index) = names.iter().position(|name| *name == camera) {
            if photo == DASH {
                return Err(Failure("photos of several cameras do not come from standard input".into()));
            }
            return Ok(vec![(index, PathBuf::from(photo))]);
        }
        if !path.exists() {
            let known = names.join(", ");
            let near = nearest(camera, names.iter().copied());
            let near = near.map(|name| format!("; did you mean `{name}={photo}`?")).unwrap_or_default();
            return Err(Failure(format!("no camera is named `{camera}`, the model has: {known}{near}")));
        }
    }
    let folders: Vec<PathBuf> = names.iter().map(|name| path.join(name)).collect();
    if folders.iter().all(|folder| folder.is_dir()) {
        return Ok(folders.into_iter().enumerate().collect());
    }
    Err(Failure(format!(
        "`{}`: say which camera took it: the model takes {}, or a folder with the folders {}",
        path.display(),
        example(rig),
        names.join(", ")
    )))
}

/// Photos of one name in the folders of all cameras, in the order of names.
fn in_folders(folders: &[PathBuf]) -> Result<Vec<Vec<PathBuf>>, Failure> {
    let mut by_name: Vec<BTreeMap<OsString, PathBuf>> = Vec::new();
    for folder in folders {
        let mut own = BTreeMap::new();
        for path in photos::listed(std::slice::from_ref(folder))? {
            let name = path.file_stem().unwrap_or(OsStr::new("")).to_os_string();
            if let Some(first) = own.insert(name, path.clone()) {
                let (first, path) = (first.display(), path.display());
                return Err(Failure(format!("`{first}` and `{path}` have one name: which is to be paired?")));
            }
        }
        by_name.push(own);
    }
    for (own, folder) in by_name.iter().zip(folders) {
        for (other, elsewhere) in by_name.iter().zip(folders) {
            if let Some((name, path)) = own.iter().find(|(name, _)| !other.contains_key(*name)) {
                return Err(Failure(format!(
                    "`{}` has no partner: there is no photo `{}` in `{}`, beside those of `{}`",
                    path.display(),
                    name.to_string_lossy(),
                    elsewhere.display(),
                    folder.display()
                )));
            }
        }
    }
    let Some(first) = by_name.first() else { return Ok(Vec::new()) };
    Ok(first.keys().map(|name| by_name.iter().map(|own| own[name].clone()).collect()).collect())
}

/// Where assemblies are judged and verdicts written.
struct Desk<'a> {
    inspector: RigInspector<'a>,
    stopwatch: &'a Stopwatch,
    format: VerdictFormat,
    /// One a camera.
    overlays: Option<Vec<Overlays>>,
    /// For the one report at the end.
    outcomes: Vec<Outcome>,
    worst: Option<Exit>,
}

impl Desk<'_> {
    fn take(&mut self, paths: &[PathBuf], bytes: Vec<io::Result<Vec<u8>>>) -> Result<(), Failure> {
        let start = Instant::now();
        let bytes: Vec<Result<Vec<u8>, String>> =
            bytes.into_iter().map(|b| b.map_err(|e| format!("cannot read the file: {e}"))).collect();
        let decode = |(camera, bytes): (usize, &Result<Vec<u8>, String>)| match bytes {
            Ok(bytes) => self.decode(camera, bytes).map_err(|e| e.to_string()),
            Err(why) => Err(why.clone()),
        };
        let photos: Vec<Result<Photo, String>> = bytes.iter().enumerate().map(decode).collect();
        let names: Vec<String> = paths.iter().map(|p| p.display().to_string()).collect();
        let shown: Vec<Option<(&Path, &[u8])>> =
            paths.iter().zip(&bytes).map(|(p, b)| Some((p.as_path(), b.as_deref().ok()?))).collect();
        self.judge(&names, &photos, &shown, start)
    }

    /// Judges an assembly, unless a photo is none yet and there is time to wait.
    fn take_if_complete(&mut self, found: &[Option<(PathBuf, Vec<u8>)>], patient: bool) -> Result<bool, Failure> {
        let start = Instant::now();
        let decode = |(camera, found): (usize, &Option<(PathBuf, Vec<u8>)>)| {
            found.as_ref().map(|(_, bytes)| self.decode(camera, bytes))
        };
        let photos: Vec<Option<Result<Photo, PhotoError>>> = found.iter().enumerate().map(decode).collect();
        if patient && photos.iter().any(|photo| matches!(photo, Some(Err(PhotoError::Unreadable(_))))) {
            self.stopwatch.lap();
            return Ok(false);
        }
        let photos: Vec<Result<Photo, String>> = photos
            .into_iter()
            .map(|photo| photo.map_or_else(|| Err("there is no photo".into()), |p| p.map_err(|e| e.to_string())))
            .collect();
        let names: Vec<String> =
            found.iter().map(|f| f.as_ref().map_or_else(String::new, |(path, _)| path.display().to_string())).collect();
        let shown: Vec<Option<(&Path, &[u8])>> =
            found.iter().map(|f| f.as_ref().map(|(path, bytes)| (path.as_path(), bytes.as_slice()))).collect();
        self.judge(&names, &photos, &shown, start)?;
        Ok(true)
    }

    fn decode(&self, camera: usize, bytes: &[u8]) -> Result<Photo, PhotoError> {
        self.inspector.photo(camera, bytes)
    }

    fn judge(
        &mut self,
        names: &[String],
        photos: &[Result<Photo, String>],
        shown: &[Option<(&Path, &[u8])>],
        start: Instant,
    ) -> Result<(), Failure> {
        let verdict = self.inspector.inspect(photos);
        let spent = self.stopwatch.lap();
        let cameras = self.inspector.rig().names().into_iter().map(str::to_string);
        let outcome = RigOutcome {
            photos: cameras.zip(names.iter().cloned()).collect(),
            verdict,
            milliseconds: Some(start.elapsed().as_secs_f64() * 1e3),
        };
        let views = outcome.verdict.views.iter().zip(shown);
        for (overlays, (view, photo)) in self.overlays.iter_mut().flatten().zip(views) {
            let Some((path, bytes)) = photo else { continue };
            overlays.admit(path)?;
            let own = Outcome { photo: String::new(), verdict: view.clone(), milliseconds: None };
            judge::write_overlay(&overlays.dir, path, bytes, &own)?;
        }
        let joint = outcome.joint();
        self.worst = self.worst.max(Some(exit_of(joint.verdict.decision)));
        match self.format {
            VerdictFormat::Human => {
                let photo = names.iter().filter(|n| !n.is_empty()).cloned().collect::<Vec<_>>().join(" + ");
                output::line(&verdict::human_of(&Outcome { photo, ..joint }, &outcome.verdict.seen_by))
            }
            VerdictFormat::Json => output::line(&outcome.json()),
            VerdictFormat::Junit => {
                self.outcomes.push(joint);
                Ok(())
            }
        }?;
        self.stopwatch.tell(&names.join(" + "), spent)
    }
}
