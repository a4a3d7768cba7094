use super::*;
use crate::runtime::camera::normalise;

/// A photo of a bright square with rounded contrast at a pose: coverage by supersampling.
fn photo(camera: &Camera, pose: &Pose) -> Grid {
    let inside = |p: Vec3| p[0].abs() < 12.0 && p[1].abs() < 8.0 && !(p[0] > 4.0 && p[1] > 2.0);
    let [width, height] = camera.size.map(|s| s as usize);
    let value = |i: usize| {
        let mut sum = 0.0;
        for s in 0..16 {
            let at = [
                (i % width) as f64 + (f64::from(s % 4) + 0.5) / 4.0,
                (i / width) as f64 + (f64::from(s / 4) + 0.5) / 4.0,
            ];
            let hit = camera.on_plane(at, pose.z).map(|p| pose.invert(p));
            sum += if hit.is_some_and(inside) { 0.8 / 16.0 } else { 0.1 / 16.0 };
        }
        sum as f32
    };
    Grid::new(width, height, (0..width * height).map(value).collect())
}

/// The outline, walked with the bright side on the right of its direction as seen in the image.
fn outline() -> Vec<[i32; 6]> {
    let corners = [[-12.0, -8.0], [-12.0, 8.0], [4.0, 8.0], [4.0, 2.0], [12.0, 2.0], [12.0, -8.0]];
    let mut rows = Vec::new();
    for i in 0..corners.len() {
        let (a, b) = (corners[i], corners[(i + 1) % corners.len()]);
        let d = normalise([b[0] - a[0], b[1] - a[1], 0.0]);
        for k in 1..20 {
            let t = f64::from(k) / 20.0;
            let at = [a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t, 0.0];
            rows.push(EdgePoint { at, along: [at[0] + d[0], at[1] + d[1], 0.0] }.to_row());
        }
    }
    rows
}

fn setup() -> (Camera, Search) {
    let camera = Camera::look_at([0.0, -60.0, 150.0], [0.0; 3], 700.0, [240, 200]);
    let points = PointSet { fault: "good".into(), coarse: outline(), fine: outline() };
    let groups = vec![PointGroup { name: "square".into(), alternatives: vec![points] }];
    let locator = Locator { coarse: 4, fine: 2, unsigned: false, groups, accept: 0.0 };
    (camera, Search::of(&locator, locator.groups.iter().map(|g| (g, 0.0))))
}

#[test]
fn a_pose_is_found_to_a_tenth_of_a_pixel() {
    let (camera, search) = setup();
    let standing = [[-4.0, 4.0], [-4.0, 4.0], [0.0, 0.0], [-0.1, 0.1]];
    let truth = Pose { x: 2.3, y: -1.7, z: 0.0, rz: 0.06 };
    let found = search.locate(&search.fields(&photo(&camera, &truth), 0.005), &camera, &standing).unwrap();
    assert!(found.score > 0.7, "{found:?}");
    for corner in [[12.0, -8.0, 0.0], [-12.0, 8.0, 0.0]] {
        let [a, b] = [truth, found.pose].map(|pose| camera.project(pose.apply(corner)).unwrap());
        assert!((a[0] - b[0]).hypot(a[1] - b[1]) < 0.15, "{found:?}");
    }
}

#[test]
fn an_installation_error_is_found_with_the_pose() {
    let (nominal, search) = setup();
    let error = Installation { turn: [0.003, -0.002, 0.004], focal: 0.006, ..Installation::default() };
    let camera = error.apply(&nominal);
    let standing = [[-4.0, 4.0], [-4.0, 4.0], [0.0, 0.0], [-0.1, 0.1]];
    let truth = Pose { x: -1.0, y: 2.0, z: 0.0, rz: -0.04 };
    let fields = search.fields(&photo(&camera, &truth), 0.005);
    let start = search.locate(&fields, &nominal, &standing).unwrap();
    let spread = [1.0, 1.0, 1.0, 0.005, 0.005, 0.005, 0.005, 0.01];
    let (installation, poses) = search.install(&[fields], &nominal, &[start.pose], &standing, &spread);
    let solved = installation.apply(&nominal);
    for corner in [[12.0, -8.0, 0.0], [-12.0, 8.0, 0.0], [12.0, 2.0, 0.0]] {
        let a = camera.project(truth.apply(corner)).unwrap();
        let b = solved.project(poses[0].apply(corner)).unwrap();
        assert!((a[0] - b[0]).hypot(a[1] - b[1]) < 0.2, "{installation:?} {poses:?}");
    }
}

#[test]
fn nothing_to_see_is_no_panic() {
    let (camera, search) = setup();
    let black = Grid::filled(240, 200, 0.0);
    let found = search.locate(&search.fields(&black, 0.005), &camera, &[[-1.0, 1.0]; 4]).unwrap();
    assert!(found.score < 0.1);
}

/// Two assemblies in one photo, the second fainter: both are where an assembly may stand, the clearer one first. Of one alone there
/// is one pose, though many of the grid lead to it.
#[test]
fn every_place_of_which_the_edges_speak_is_told() {
    let (camera, search) = setup();
    let standing = [[-12.0, 12.0], [-4.0, 4.0], [0.0, 0.0], [-0.05, 0.05]];
    let at = |x: f64| Pose { x, y: 0.5, z: 0.0, rz: 0.01 };
    let (left, right) = (photo(&camera, &at(-11.0)), photo(&camera, &at(11.0)));
    let rivals = |photo: &Grid| search.rivals(&search.fields(photo, 0.005), &camera, &standing, &nobody);
    let one = rivals(&left);
    assert!(one.len() == 1 && (one[0].pose.x + 11.0).abs() < 0.1, "{one:?}");
    // The one on the right lacks its lower rows.
    let cut = right.width * 120;
    let fainter = right.values.iter().enumerate().map(|(i, v)| if i < cut { *v } else { 0.1 });
    let both = left.values.iter().zip(fainter).map(|(a, b)| a.max(b)).collect();
    let two = rivals(&Grid::new(left.width, left.height, both));
    assert!(two.len() == 2 && two[0].score > two[1].score && two[1].score > RIVAL * two[0].score, "{two:?}");
    assert!((two[0].pose.x + 11.0).abs() < 0.1 && (two[1].pose.x - 11.0).abs() < 0.5, "{two:?}");
}

#[test]
fn a_score_below_zero_is_still_the_best() {
    let (camera, search) = setup();
    let pose = |x: f64, score: f64| Located { pose: Pose { x, y: 0.0, z: 0.0, rz: 0.0 }, score };
    let distinct = search.distinct(vec![pose(-3.0, -0.5), pose(3.0, -0.1), pose(3.1, -0.1)], &camera, RIVAL);
    assert_eq!(distinct, [pose(3.0, -0.1)]);
    assert_eq!(search.distinct(Vec::new(), &camera, RIVAL), []);
}

/// Half of the outline's points belong to a part that lies 1 px beside its place: with the play it has, the pose stays with
/// the other half.
#[test]
fn a_part_with_play_does_not_drag_the_pose() {
    let (camera, _) = setup();
    let standing = [[-4.0, 4.0], [-4.0, 4.0], [0.0, 0.0], [-0.1, 0.1]];
    let truth = Pose { x: 1.0, y: -0.5, z: 0.0, rz: 0.02 };
    let fields = |search: &Search| search.fields(&photo(&camera, &truth), 0.005);
    let mut moved = outline();
    moved.iter_mut().for_each(|row| row[0] += 250);
    let group = |name: &str, rows: Vec<[i32; 6]>| PointGroup {
        name: name.into(),
        alternatives: vec![PointSet { fault: "good".into(), coarse: rows.clone(), fine: rows }],
    };
    let groups = vec![group("base", outline()), group("loose", moved)];
    let locator = Locator { coarse: 4, fine: 2, unsigned: false, groups, accept: 0.0 };
    let off = |play: f64| {
        let search = Search::of(&locator, locator.groups.iter().zip([0.0, play]));
        let found = search.locate(&fields(&search), &camera, &standing).unwrap();
        (found.pose.x - truth.x).abs()
    };
    assert!(off(0.0) > 0.08 && off(1.5) < 0.03, "{} {}", off(0.0), off(1.5));
}
