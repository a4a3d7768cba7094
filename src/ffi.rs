//! The runtime's C interface: `include/gonogo.h` says what each function promises.
//!
//! In: pointers of a caller who may err. Out: a code and a text. The only file with `unsafe` in it, and only behind the
//! feature `c`: it turns pointers into slices and back and leaves the rest to [`embed`](crate::runtime::embed). Null
//! pointers and impossible sizes are answered, and no panic crosses the border.

#![allow(unsafe_code)]

use crate::runtime::embed::{self, Session};
use crate::runtime::inspect::Decision;
use crate::runtime::photo::{PixelFormat, Pixels};
use crate::runtime::report::Outcome;
use std::ffi::{CStr, c_char};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::{ptr, slice};

/// Grows when a function changes its meaning.
const ABI: u32 = 1;

const OK: i32 = 0;
const GO: i32 = 0;
const NO_GO: i32 = 1;
const CANNOT_INSPECT: i32 = 2;
const BAD_ARGUMENT: i32 = -1;
const REFUSED: i32 = -2;
const INTERNAL: i32 = -3;

/// A text of ours in the caller's hands: UTF-8, with a zero after its end.
#[repr(C)]
pub struct Text {
    data: *mut c_char,
    /// Without the zero.
    size: usize,
}

/// Pixels of the caller, top row first.
#[repr(C)]
pub struct Image {
    data: *const u8,
    /// Bytes that may be read from there.
    size: usize,
    /// Bytes from one row to the next.
    stride: usize,
    width: u32,
    height: u32,
    format: u32,
}

#[unsafe(no_mangle)]
pub extern "C" fn gonogo_abi() -> u32 {
    ABI
}

#[unsafe(no_mangle)]
pub extern "C" fn gonogo_version() -> *const c_char {
    concat!(env!("CARGO_PKG_VERSION"), "\0").as_ptr().cast()
}

/// # Safety
/// The pointers are null or point to as many bytes as their sizes say.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gonogo_open(
    model: *const u8,
    model_size: usize,
    calibration: *const u8,
    calibration_size: usize,
    inspector: *mut *mut Session,
    message: *mut Text,
) -> i32 {
    if inspector.is_null() {
        return answer(message, || Err((BAD_ARGUMENT, "`inspector` is null".into())));
    }
    // SAFETY: not null, and the caller's word is that it may be written.
    unsafe { inspector.write(ptr::null_mut()) };
    answer(message, || {
        // SAFETY: the caller's word on pointers and sizes, as below.
        let model = unsafe { bytes(model, model_size, "model") }?;
        let calibration = if calibration.is_null() {
            None
        } else {
            Some(unsafe { bytes(calibration, calibration_size, "calibration") }?)
        };
        let session = Session::open(model, calibration).map_err(refused)?;
        unsafe { inspector.write(Box::into_raw(Box::new(session))) };
        Ok((OK, String::new()))
    })
}

/// # Safety
/// `inspector` is null or from `gonogo_open`, and was not closed before.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gonogo_close(inspector: *mut Session) {
    if !inspector.is_null() {
        // SAFETY: made by `Box::into_raw` in `gonogo_open`.
        let session = unsafe { Box::from_raw(inspector) };
        let _ = catch_unwind(AssertUnwindSafe(|| drop(session)));
    }
}

/// # Safety
/// `inspector` is null or from `gonogo_open`; `width` and `height` are null or may be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gonogo_photo_size(inspector: *const Session, width: *mut u32, height: *mut u32) -> i32 {
    // SAFETY: the caller's word.
    let Some(session) = (unsafe { inspector.as_ref() }) else { return BAD_ARGUMENT };
    if width.is_null() || height.is_null() {
        return BAD_ARGUMENT;
    }
    let size = session.size();
    unsafe {
        width.write(size[0]);
        height.write(size[1]);
    }
    OK
}

/// # Safety
/// The pointers are null or as the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gonogo_judge_file(
    inspector: *const Session,
    name: *const c_char,
    file: *const u8,
    file_size: usize,
    verdict: *mut Text,
) -> i32 {
    answer(verdict, || {
        // SAFETY: the caller's word on pointers and sizes.
        let (session, name) = unsafe { (session(inspector)?, name_of(name)) };
        let file = unsafe { bytes(file, file_size, "file") }?;
        Ok(judged(&session.judge_file(&name, file)))
    })
}

/// # Safety
/// The pointers are null or as the header says; `grey` is null or `grey_size` bytes there may be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gonogo_show_file(
    inspector: *const Session,
    name: *const c_char,
    file: *const u8,
    file_size: usize,
    grey: *mut u8,
    grey_size: usize,
    verdict: *mut Text,
) -> i32 {
    answer(verdict, || {
        // SAFETY: the caller's word on pointers and sizes.
        let (session, name) = unsafe { (session(inspector)?, name_of(name)) };
        let file = unsafe { bytes(file, file_size, "file") }?;
        let [width, height] = session.size().map(|s| s as usize);
        if !grey.is_null() && grey_size < width * height {
            return Err((BAD_ARGUMENT, format!("`grey` has {grey_size} bytes for {width}x{height} px")));
        }
        let (outcome, pixels) = session.show_file(&name, file);
        if let Some(pixels) = pixels.as_ref().filter(|p| !grey.is_null() && p.len() <= grey_size) {
            // SAFETY: not null, as large as the caller says, and our own vector is not the caller's memory.
            unsafe { ptr::copy_nonoverlapping(pixels.as_ptr(), grey, pixels.len()) };
        }
        Ok((judged(&outcome).0, outcome.json_in_full(pixels.is_some())))
    })
}

/// # Safety
/// The pointers are null or as the header says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gonogo_judge_pixels(
    inspector: *const Session,
    name: *const c_char,
    image: *const Image,
    verdict: *mut Text,
) -> i32 {
    answer(verdict, || {
        // SAFETY: the caller's word on pointers and sizes.
        let (session, name) = unsafe { (session(inspector)?, name_of(name)) };
        let image = unsafe { image.as_ref() }.ok_or_else(|| null("image"))?;
        let format = format_of(image.format)?;
        let bytes = unsafe { bytes(image.data, image.size, "image->data") }?;
        let pixels = Pixels { bytes, format, size: [image.width, image.height], stride: image.stride };
        Ok(judged(&session.judge_pixels(&name, &pixels)))
    })
}

/// # Safety
/// The pointers are null or point to as many bytes as their sizes say.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gonogo_calibrate(
    model: *const u8,
    model_size: usize,
    photo: *const u8,
    photo_size: usize,
    calibration: *mut Text,
) -> i32 {
    answer(calibration, || {
        // SAFETY: the caller's word on pointers and sizes.
        let (model, photo) = unsafe { (bytes(model, model_size, "model")?, bytes(photo, photo_size, "photo")?) };
        Ok((OK, embed::calibrate(model, &[photo]).map_err(refused)?))
    })
}

/// # Safety
/// `text` is null, or holds what a function here wrote, or zeros.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gonogo_text_free(text: *mut Text) {
    // SAFETY: the caller's word.
    let Some(text) = (unsafe { text.as_mut() }) else { return };
    if !text.data.is_null() {
        // SAFETY: made by `give` with this size and the zero.
        drop(unsafe { Box::from_raw(ptr::slice_from_raw_parts_mut(text.data.cast::<u8>(), text.size + 1)) });
    }
    *text = Text { data: ptr::null_mut(), size: 0 };
}

/// The version once more, in a custom section `gonogo` of the module: it can be read without running it.
#[cfg(target_family = "wasm")]
#[used]
#[unsafe(link_section = "gonogo")]
static VERSION: [u8; env!("CARGO_PKG_VERSION").len()] = *{
    let version = env!("CARGO_PKG_VERSION").as_bytes();
    version.first_chunk().expect("an array as long as the text")
};

/// Memory for the host to fill, where it has no allocator of its own: in a browser. Null for no bytes or none left.
#[cfg(target_family = "wasm")]
#[unsafe(no_mangle)]
pub extern "C" fn gonogo_alloc(size: usize) -> *mut u8 {
    let mut memory = Vec::<u8>::new();
    if size == 0 || memory.try_reserve_exact(size).is_err() {
        return ptr::null_mut();
    }
    memory.resize(size, 0);
    Box::into_raw(memory.into_boxed_slice()).cast()
}

/// # Safety
/// `memory` is null or from `gonogo_alloc` with the same size.
#[cfg(target_family = "wasm")]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gonogo_free(memory: *mut u8, size: usize) {
    if !memory.is_null() {
        // SAFETY: the caller's word.
        drop(unsafe { Box::from_raw(ptr::slice_from_raw_parts_mut(memory, size)) });
    }
}

/// A code with its text: a result, or an error.
type Answer = Result<(i32, String), (i32, String)>;

/// Does the work, stops a panic, and hands the text over where it is wanted.
fn answer(out: *mut Text, work: impl FnOnce() -> Answer) -> i32 {
    let outcome = catch_unwind(AssertUnwindSafe(work));
    let panicked = || (INTERNAL, "internal error: please report it with the model and the photo".to_string());
    let (code, text) = outcome.map_or_else(|_| panicked(), |answer| answer.unwrap_or_else(|error| error));
    if !out.is_null() {
        // SAFETY: not null, and the caller's word is that it may be written.
        unsafe { out.write(give(text)) };
    }
    code
}

fn give(text: String) -> Text {
    let size = text.len();
    let mut bytes = text.into_bytes();
    bytes.push(0);
    Text { data: Box::into_raw(bytes.into_boxed_slice()).cast(), size }
}

fn judged(outcome: &Outcome) -> (i32, String) {
    let code = match outcome.verdict.decision {
        Decision::Go => GO,
        Decision::NoGo => NO_GO,
        Decision::CannotInspect => CANNOT_INSPECT,
    };
    (code, outcome.json())
}

fn refused(why: String) -> (i32, String) {
    (REFUSED, why)
}

fn null(name: &str) -> (i32, String) {
    (BAD_ARGUMENT, format!("`{name}` is null"))
}

fn format_of(format: u32) -> Result<PixelFormat, (i32, String)> {
    Ok(match format {
        1 => PixelFormat::Grey8,
        2 => PixelFormat::Grey16,
        3 => PixelFormat::Rgb8,
        4 => PixelFormat::Bgr8,
        5 => PixelFormat::Rgba8,
        other => return Err((BAD_ARGUMENT, format!("{other} is no pixel format"))),
    })
}

/// # Safety
/// `data` is null or points to `size` bytes that outlive the slice.
unsafe fn bytes<'a>(data: *const u8, size: usize, name: &str) -> Result<&'a [u8], (i32, String)> {
    if data.is_null() {
        return Err(null(name));
    }
    if isize::try_from(size).is_err() {
        return Err((BAD_ARGUMENT, format!("`{name}` cannot have {size} bytes")));
    }
    // SAFETY: not null, no larger than any object, and the caller's word on the rest.
    Ok(unsafe { slice::from_raw_parts(data, size) })
}

/// # Safety
/// `inspector` is null or from `gonogo_open` and not closed.
unsafe fn session<'a>(inspector: *const Session) -> Result<&'a Session, (i32, String)> {
    // SAFETY: the caller's word.
    unsafe { inspector.as_ref() }.ok_or_else(|| null("inspector"))
}

/// # Safety
/// `name` is null or ends with a zero.
unsafe fn name_of(name: *const c_char) -> String {
    // SAFETY: not null, and the caller's word on the zero.
    if name.is_null() { String::new() } else { unsafe { CStr::from_ptr(name) }.to_string_lossy().into_owned() }
}
