//! The kernel's tolerances, in one place. Lengths in mm.

/// Surfaces whose parameters differ by less are one surface; points nearer than this to a surface lie on it.
/// Far above the rounding of a turned part (1e-13), far below any tolerance of a drawing.
pub(super) const POINT: f64 = 1e-7;
/// Surfaces of one kind whose parameters differ by more than [`POINT`] but less than this are too near to be told apart by
/// their corners, and too far to be one.
pub(super) const APART: f64 = 5e-6;
/// Directions whose cross product is shorter are parallel (rad): 50 mm away this is half of [`POINT`].
pub(super) const DIRECTION: f64 = 1e-9;
/// Surfaces that overlap or miss each other by less than this touch.
pub(super) const TOUCH: f64 = 1e-7;
/// Corners nearer than this are one corner.
pub(super) const WELD: f64 = 1e-6;
/// Boxes that cull are widened by this.
pub(super) const CULL: f64 = 1e-4;
