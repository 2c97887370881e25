//! A recording of some frames with their clouds, to see whether they fit together.

use rerun::{Points2D, Radius, ViewCoordinates};

use super::encode::jpeg;
use super::scene::{self, Origin};
use super::stream::Stream;
use super::{Identity, RecordError, Targets, entities};
use crate::palette;
use crate::picture;
use crate::render::{RenderParams, color_cloud};
use crate::scene::{Scene, SceneError};

/// Why a scene could not be recorded.
#[derive(Debug, thiserror::Error)]
pub enum CheckupError {
    /// A frame cannot be read.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The recording cannot be written.
    #[error(transparent)]
    Record(#[from] RecordError),
}

/// Records frames of a scene: each with its camera, photo and cloud in the world, and with its cloud on its
/// photo.
///
/// # Errors
/// [`CheckupError`].
pub fn record_checkup(
    targets: &Targets,
    scene: &dyn Scene,
    frames: &[usize],
) -> Result<(), CheckupError> {
    let names = frames.iter().map(|&frame| scene.frames()[frame].clone());
    let identity = Identity {
        scene: scene.name().to_owned(),
        references: names.collect(),
        ..Identity::default()
    };
    let mut stream = Stream::open(targets, &identity)?;
    stream.log_static(entities::WORLD, &ViewCoordinates::RDF());
    let mut origin = None;
    for (index, &frame) in frames.iter().enumerate() {
        let tuple = scene.reference(frame)?;
        let place = tuple.world_from_camera.translation.vector;
        let origin = *origin.get_or_insert(Origin(place));
        stream.set_query(index);
        stream.advance();
        match jpeg(&picture::photo(&tuple.photo)) {
            Ok(photo) => {
                stream.log_image("check/photo", Ok(photo.clone()));
                scene::log_reference(&mut stream, index, &tuple, &tuple.name, Ok(photo), origin);
            }
            Err(why) => stream.log_image("check/photo", Err(why)),
        }
        let params = RenderParams::default();
        let colored = color_cloud(&tuple.cloud, &tuple.photo.gray, &tuple.intrinsics, &params);
        scene::log_cloud(&mut stream, index, &tuple, &colored, origin);
        let seen = tuple.cloud.points.iter().filter_map(|point| {
            let pixel = tuple.intrinsics.project(&point.cast())?;
            let is_in_view = tuple.intrinsics.contains(&pixel);
            is_in_view.then_some((pixel, f64::from(point.z)))
        });
        let (places, colors): (Vec<[f32; 2]>, Vec<rerun::Color>) = seen
            .map(|(pixel, depth_m)| {
                // Rerun counts pixels from the corner of the first.
                let place = [pixel.x as f32 + 0.5, pixel.y as f32 + 0.5];
                let near = 1.0 - (depth_m.max(1.0).ln() / 80.0_f64.ln()).min(1.0);
                (place, super::color(palette::viridis(near)))
            })
            .unzip();
        let points = Points2D::new(places)
            .with_colors(colors)
            .with_radii([Radius::new_ui_points(1.2)]);
        stream.log("check/photo/cloud", &points);
        stream.flush();
    }
    stream.close()?;
    Ok(())
}
