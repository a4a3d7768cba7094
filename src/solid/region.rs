//! What later stages ask of a solid: bounds, counts, the region a face covers on its surface.
//!
//! In: a [`Solid`]. Out: boxes, numbers, polygons. Nothing here changes a solid.

use super::border::{Grid, Outline};
use super::ring::offsets;
use super::{Face, Quality, Solid, Surface, mesh};
use nalgebra::Point3;

/// Numbers of faces by kind of surface, of edges and of corners.
///
/// `edges` and `corners` are what is there. A modeller of the kind of Open CASCADE also draws a seam on each face that
/// goes all the way round, and a vertex on each closed edge: [`Counts::edges_with_seams`], [`Counts::vertices`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    pub planes: usize,
    pub cylinders: usize,
    pub cones: usize,
    pub spheres: usize,
    pub tori: usize,
    pub edges: usize,
    /// Edges without a corner.
    pub closed_edges: usize,
    /// Faces that go all the way round their axis.
    pub seams: usize,
    pub corners: usize,
}

impl Counts {
    pub fn faces(&self) -> usize {
        self.planes + self.cylinders + self.cones + self.spheres + self.tori
    }

    pub fn edges_with_seams(&self) -> usize {
        self.edges + self.seams
    }

    /// Corners and one vertex on every closed edge.
    pub fn vertices(&self) -> usize {
        self.corners + self.closed_edges
    }
}

impl Solid {
    pub fn counts(&self) -> Counts {
        let kind =
            |wanted: fn(&Surface) -> bool| self.faces.iter().filter(|f| wanted(&self.surfaces[f.surface])).count();
        let offsets = offsets(self.vertices.len(), &self.edges);
        let round = |face: &usize| {
            let outer = mesh::rings(self, *face, &offsets).is_some_and(|(_, rings)| rings.iter().any(|r| r.is_outer()));
            self.surface(*face).period().is_some() && !outer
        };
        Counts {
            planes: kind(|s| matches!(s, Surface::Plane { .. })),
            cylinders: kind(|s| matches!(s, Surface::Cylinder { .. })),
            cones: kind(|s| matches!(s, Surface::Cone { .. })),
            spheres: kind(|s| matches!(s, Surface::Sphere { .. })),
            tori: kind(|s| matches!(s, Surface::Torus { .. })),
            edges: self.edges.len(),
            closed_edges: self.edges.iter().filter(|e| e.ends[0].is_none()).count(),
            seams: (0..self.faces.len()).filter(round).count(),
            corners: self.vertices.len(),
        }
    }

    /// Lowest and highest corner of a box round the triangles, along the part's axes (mm). A curved side may bulge past it
    /// by the chord of [`Quality`].
    pub fn bounds(&self) -> [Point3<f64>; 2] {
        let first = self.mesh.positions.first().copied().unwrap_or_else(Point3::origin);
        self.mesh.positions.iter().fold([first, first], |[low, high], p| [low.inf(p), high.sup(p)])
    }

    /// The surface of a face.
    pub fn surface(&self, face: usize) -> &Surface {
        &self.surfaces[self.faces[face].surface]
    }

    /// Unit normal that points out of the material at `p` on the face.
    pub fn outward_normal(&self, face: usize, p: &Point3<f64>) -> nalgebra::Vector3<f64> {
        let Face { outward, .. } = self.faces[face];
        self.surface(face).normal_at(p) * if outward { 1.0 } else { -1.0 }
    }

    /// The face as polygons in the chart of its surface ([`Surface::chart`], in the frame of [`Surface::frame`]):
    /// the outer one first, counter-clockwise, then holes, clockwise; the last point joins the first.
    ///
    /// The chart is equal-area: the polygons' area is the face's, up to the chords. On a closed surface u is continuous
    /// round each polygon, so it may leave -P/2..P/2, with P the [`Surface::period`]: two regions are compared modulo P. A
    /// face that goes all the way round is cut along a seam into one polygon P wide.
    pub fn face_region(&self, face: usize) -> Vec<Vec<[f64; 2]>> {
        let offsets = offsets(self.vertices.len(), &self.edges);
        let Some((chart, rings)) = mesh::rings(self, face, &offsets) else { return Vec::new() };
        let steps = mesh::steps(&chart, &rings, &Quality::default());
        let mut grid = Grid { steps, fresh: &mut |_| u32::MAX };
        let Some(outline) = Outline::new(&chart, &rings, &mut grid) else { return Vec::new() };
        let polygons = std::iter::once(outline.outer).chain(outline.holes);
        polygons.map(|nodes| nodes.iter().map(|n| chart.own(n.uv)).collect()).collect()
    }
}
