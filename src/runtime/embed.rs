//! The runtime in another program: bytes in, a verdict or a sentence out.
//!
//! In: the bytes of a model, a calibration and photos. Out: [`Outcome`]s, or why not. Files, clocks and threads are the
//! host's; the C interface (`src/ffi.rs`) and the browser stand on this page.

use super::calibrate::{self, Calibration};
use super::inspect::Inspector;
use super::model::Model;
use super::photo::{Photo, PhotoError, Pixels, Tone};
use super::report::Outcome;

/// A model with its calibration, ready to judge photo after photo.
pub struct Session {
    inspector: Inspector<'static>,
}

impl Session {
    /// Reads a model and its calibration; without one, camera and lamps are taken to be as the spec says.
    pub fn open(model: &[u8], calibration: Option<&[u8]>) -> Result<Session, String> {
        let model = read_model(model)?;
        let calibration = match calibration {
            Some(bytes) => Calibration::read(text(bytes)?, &model).map_err(|e| e.to_string())?,
            None => Calibration::nominal(&model),
        };
        let unusable = || "E0803: the model's camera cannot see its own nodes: compile the spec again".to_string();
        Ok(Session { inspector: Inspector::owned(model, calibration).ok_or_else(unusable)? })
    }

    /// Width and height that photos must have (px).
    pub fn size(&self) -> [u32; 2] {
        self.inspector.model().station.camera.size
    }

    fn tone(&self) -> Tone {
        self.inspector.model().station.tone
    }

    /// Judges an image file. `name` is what the verdict calls it.
    pub fn judge_file(&self, name: &str, bytes: &[u8]) -> Outcome {
        self.judge(name, Photo::decode(bytes, self.tone(), self.size()))
    }

    /// The same, and the photo's grey values for people, one byte a pixel; `None` where it could not be decoded.
    pub fn show_file(&self, name: &str, bytes: &[u8]) -> (Outcome, Option<Vec<u8>>) {
        let photo = Photo::decode(bytes, self.tone(), self.size());
        let grey = photo.as_ref().ok().map(|photo| photo.grey(self.tone()));
        (self.judge(name, photo), grey)
    }

    /// Judges pixels in memory.
    pub fn judge_pixels(&self, name: &str, pixels: &Pixels) -> Outcome {
        self.judge(name, Photo::from_pixels(pixels, self.tone(), self.size()))
    }

    fn judge(&self, name: &str, photo: Result<Photo, PhotoError>) -> Outcome {
        let outcome = match photo {
            Ok(photo) => Outcome { photo: name.into(), verdict: self.inspector.inspect(&photo), milliseconds: None },
            Err(e) => Outcome::unreadable(name.into(), e.to_string()),
        };
        // The host has the clock.
        Outcome { milliseconds: None, ..outcome }
    }
}

/// Fits a model to its station by image files of correct assemblies; the text of the calibration.
pub fn calibrate(model: &[u8], photos: &[&[u8]]) -> Result<String, String> {
    let model = read_model(model)?;
    let station = &model.station;
    let decode = |bytes: &&[u8]| Photo::decode(bytes, station.tone, station.camera.size).map_err(|e| e.to_string());
    let photos = photos.iter().map(decode).collect::<Result<Vec<Photo>, String>>()?;
    Ok(calibrate::calibrate(&model, &photos).map_err(|e| e.to_string())?.write())
}

fn read_model(bytes: &[u8]) -> Result<Model, String> {
    Model::read(text(bytes)?).map_err(|e| e.to_string())
}

fn text(bytes: &[u8]) -> Result<&str, String> {
    std::str::from_utf8(bytes).map_err(|_| "E0803: this is not UTF-8 text".into())
}
