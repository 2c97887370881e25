//! The small world as a scene: five frames, the camera moving ahead, one of them spoiled.

use posescope_core::camera::Intrinsics;
use posescope_core::cloud::Cloud;
use posescope_core::geometry::Pose;
use posescope_core::image::Photo;
use posescope_core::scene::{Scene, SceneError};

use crate::two_walls::{CAMERA, cloud_of_the_walls, photo};

/// Frames 000000 to 000004, at 0, 1, 0.5 and 0.8 m ahead; 000003 shows nothing but grey, and the
/// photo of 000004 cannot be read.
pub struct Walls {
    names: Vec<String>,
}

const AHEAD_M: [f64; 5] = [0.0, 1.0, 0.5, 0.8, 0.2];
pub const GREY: usize = 3;
pub const UNREADABLE: usize = 4;

impl Walls {
    pub fn new() -> Self {
        Self { names: (0..AHEAD_M.len()).map(|i| format!("{i:06}")).collect() }
    }
}

impl Scene for Walls {
    fn name(&self) -> &str {
        "walls"
    }
    fn frames(&self) -> &[String] {
        &self.names
    }
    fn intrinsics(&self, _frame: usize) -> Intrinsics {
        CAMERA
    }
    fn pose(&self, frame: usize) -> Option<Pose> {
        Some(Pose::translation(100.0, -2.0, 30.0 + AHEAD_M[frame]))
    }
    fn time_s(&self, frame: usize) -> Option<f64> {
        Some(frame as f64)
    }
    fn has_cloud(&self, frame: usize) -> bool {
        matches!(frame, 0 | 2)
    }
    fn photo(&self, frame: usize) -> Result<Photo, SceneError> {
        match frame {
            GREY => Ok(Photo::from_gray(image::GrayImage::from_pixel(
                CAMERA.width,
                CAMERA.height,
                image::Luma([90]),
            ))),
            UNREADABLE => Err(SceneError::UnknownFrame {
                scene: "walls".to_owned(),
                frame: self.names[frame].clone(),
                known: "000000 … 000003".to_owned(),
            }),
            _ => Ok(Photo::from_gray(photo(AHEAD_M[frame], 5))),
        }
    }
    fn cloud(&self, frame: usize) -> Result<Cloud, SceneError> {
        assert!(self.has_cloud(frame), "this frame has no cloud");
        let mut cloud = cloud_of_the_walls();
        for point in &mut cloud.points {
            point.z -= AHEAD_M[frame] as f32;
        }
        Ok(cloud)
    }
}

/// Frame 1 is seen by a camera of half the size.
pub struct TwoCameras(pub Walls);

impl Scene for TwoCameras {
    posescope_core::inner_scene!(0: frames, pose, time_s, has_cloud, cloud);

    fn name(&self) -> &str {
        "two cameras"
    }

    fn intrinsics(&self, frame: usize) -> Intrinsics {
        let camera = self.0.intrinsics(frame);
        match frame {
            1 => Intrinsics {
                fx: camera.fx / 2.0,
                fy: camera.fy / 2.0,
                cx: (camera.cx - 0.5) / 2.0,
                cy: (camera.cy - 0.5) / 2.0,
                width: camera.width / 2,
                height: camera.height / 2,
            },
            _ => camera,
        }
    }

    fn photo(&self, frame: usize) -> Result<Photo, SceneError> {
        let photo = self.0.photo(frame)?;
        let Intrinsics { width, height, .. } = self.intrinsics(frame);
        if photo.dimensions() == (width, height) {
            return Ok(photo);
        }
        let mean = |x: u32, y: u32| {
            let four = [(0, 0), (1, 0), (0, 1), (1, 1)];
            let values = four.map(|(right, down)| {
                u32::from(photo.gray.get_pixel(2 * x + right, 2 * y + down).0[0])
            });
            image::Luma([(values.iter().sum::<u32>() / 4) as u8])
        };
        Ok(Photo::from_gray(image::GrayImage::from_fn(width, height, mean)))
    }
}
