//! Restricts a map to the points in a camera's view: inside its image and not occluded.

use nalgebra::Point3;

use super::depth_image;
use crate::camera::Intrinsics;
use crate::cloud::Cloud;

/// Nearer points are ignored \[m\]: they are the camera itself or its carrier.
const NEAREST_M: f64 = 0.1;
/// The search range for occluders around a point \[cells\]: twice the gaps between the lines of a scanner with 32
/// beams.
const AROUND: isize = 6;
/// Points with more than this share of a point's depth belong to the same slanted surface.
const SAME_SURFACE: f32 = 0.9;
/// An occluded point has nearer points in at least this many of eight directions. A visible point next to a post
/// has them in three, between two posts in six.
const HIDDEN_IN: u32 = 7;

/// The points in view, of points in the camera's frame \[m\]: the nearest point per small cell of the image, unless it
/// is seen through the gaps of something nearer. The cell size gives about as many points as a scan, for maps of any
/// density.
pub(super) fn in_view(points: impl Iterator<Item = Point3<f64>>, camera: &Intrinsics) -> Cloud {
    let side = depth_image::step((camera.width, camera.height));
    let columns = camera.width.div_ceil(side) as usize;
    let rows = camera.height.div_ceil(side) as usize;
    let mut nearest: Vec<Option<Point3<f32>>> = vec![None; columns * rows];
    for point in points {
        let Some(pixel) = camera.project(&point).filter(|pixel| camera.contains(pixel)) else {
            continue;
        };
        if point.z < NEAREST_M {
            continue;
        }
        let cell = |at: f64| ((at + 0.5) / f64::from(side)) as usize;
        let place = &mut nearest[cell(pixel.y) * columns + cell(pixel.x)];
        let point: Point3<f32> = point.cast();
        if place.is_none_or(|other| point.z < other.z) {
            *place = Some(point);
        }
    }
    let cells = nearest.iter().enumerate();
    let visible = cells.filter_map(|(at, point)| {
        let point = (*point)?;
        (!is_hidden(&nearest, columns, at, point.z)).then_some(point)
    });
    Cloud { points: visible.collect() }
}

/// Whether nearer points surround a cell.
fn is_hidden(nearest: &[Option<Point3<f32>>], columns: usize, at: usize, depth: f32) -> bool {
    let rows = nearest.len() / columns;
    let (column, row) = ((at % columns) as isize, (at / columns) as isize);
    let mut directions = 0_u32;
    for dy in -AROUND..=AROUND {
        for dx in -AROUND..=AROUND {
            let (x, y) = (column + dx, row + dy);
            let is_inside = (0..columns as isize).contains(&x) && (0..rows as isize).contains(&y);
            let beside = is_inside.then(|| nearest[y as usize * columns + x as usize]);
            if let Some(Some(other)) = beside
                && other.z < SAME_SURFACE * depth
                && let Some(direction) = direction(dx, dy)
            {
                directions |= 1 << direction;
            }
        }
    }
    directions.count_ones() >= HIDDEN_IN
}

/// The direction of an offset, in eighths of a turn.
fn direction(dx: isize, dy: isize) -> Option<u32> {
    if (dx, dy) == (0, 0) {
        return None;
    }
    let eighths = (dy as f64).atan2(dx as f64) / std::f64::consts::FRAC_PI_4;
    Some(eighths.round().rem_euclid(8.0) as u32)
}

#[cfg(test)]
mod tests {
    use super::*;

    const CAMERA: Intrinsics =
        Intrinsics { fx: 300.0, fy: 300.0, cx: 319.5, cy: 239.5, width: 640, height: 480 };

    fn wall(depth: f64, step_px: f64) -> impl Iterator<Item = Point3<f64>> {
        let (columns, rows) = ((640.0 / step_px) as usize, (480.0 / step_px) as usize);
        let pixels = (0..rows).flat_map(move |row| (0..columns).map(move |column| (column, row)));
        pixels.map(move |(column, row)| {
            let pixel = nalgebra::Point2::new(column as f64 * step_px, row as f64 * step_px);
            CAMERA.unproject(&pixel, depth)
        })
    }

    #[test]
    fn a_near_wall_hides_a_far_one_and_what_is_behind_is_left_out() {
        let walls = [0.05, 4.0, 9.0].map(|depth| wall(depth, 2.0));
        let behind = wall(5.0, 2.0).map(|point| Point3::from(-point.coords));
        let cloud = in_view(walls.into_iter().flatten().chain(behind), &CAMERA);
        assert_eq!(cloud.len(), 160 * 120);
        assert!(cloud.points.iter().all(|point| point.z == 4.0));
    }

    #[test]
    fn a_wall_of_few_points_hides_what_is_seen_between_them() {
        // A point in nine squares of the near one, in each square of the far one.
        let cloud = in_view(wall(4.0, 12.0).chain(wall(12.0, 4.0)), &CAMERA);
        let far: Vec<_> = cloud.points.iter().filter(|point| point.z > 5.0).collect();
        // Along the border nothing is beside a square.
        assert!(far.len() < 1_500, "{}", far.len());
    }

    #[test]
    fn what_is_beside_a_post_or_on_a_road_stays() {
        // Two posts, with a gap of 9 squares between them, before a wall.
        let post =
            |from: f64| wall(4.0, 4.0).filter(move |point| (from..from + 0.2).contains(&point.x));
        let posts = post(-0.5).chain(post(0.2));
        let wall_alone = in_view(wall(12.0, 4.0), &CAMERA).len();
        let cloud = in_view(posts.chain(wall(12.0, 4.0)), &CAMERA);
        let posts = cloud.points.iter().filter(|point| point.z < 5.0).count();
        assert_eq!(cloud.len(), wall_alone, "{posts} of posts");
        // A road, seen at a slant, hides none of itself.
        let road = |row: usize| {
            let pixel =
                move |column: usize| nalgebra::Point2::new(column as f64, 250.0 + row as f64);
            let depth = 1.7 * 300.0 / (250.0 + row as f64 - 239.5);
            (0..640).map(move |column| CAMERA.unproject(&pixel(column), depth))
        };
        let cloud = in_view((0..230).flat_map(road), &CAMERA);
        assert_eq!(cloud.len(), 160 * 58, "all squares from row 62 on");
    }
}
