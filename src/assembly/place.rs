//! Poses of the components for one draw of the dimensions.

use crate::design::model::{Design, Values};
use nalgebra::Isometry3;

/// The pose of every component in the assembly's frame (mm): zones compose down the chain of parents.
pub fn place(design: &Design, values: &Values) -> Vec<Isometry3<f64>> {
    let mut poses: Vec<Isometry3<f64>> = Vec::with_capacity(design.components.len());
    for component in &design.components {
        let parent = component.parent.map_or_else(Isometry3::identity, |i| poses[i]);
        poses.push(parent * component.frame.eval(values) * component.pose.eval(values));
    }
    poses
}
