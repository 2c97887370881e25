//! What comes out of the graphics card, against what the processor says.

use egui::Color32;
use nalgebra::Point3;
use proptest::prelude::*;
use proptest::test_runner::{Config, TestRunner};

use super::pipelines::COLOR;
use super::*;
use crate::app::views::space::view_camera::ViewCamera;
use crate::geometry::Pose;

const SIZE: [u32; 2] = [320, 240];
const BLACK: Color32 = Color32::BLACK;
const RED: Color32 = Color32::from_rgb(255, 0, 0);
const GREEN: Color32 = Color32::from_rgb(0, 255, 0);

struct Card {
    device: wgpu::Device,
    queue: wgpu::Queue,
    pipelines: Pipelines,
}

impl Card {
    /// Any adapter there is, software included; `None`, and a line that says so, without one.
    fn any() -> Option<Self> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
        let options = wgpu::RequestAdapterOptions::default();
        let Ok(adapter) = pollster::block_on(instance.request_adapter(&options)) else {
            println!("skipped: no graphics adapter");
            return None;
        };
        let descriptor = wgpu::DeviceDescriptor {
            required_limits: adapter.limits(),
            ..wgpu::DeviceDescriptor::default()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor)).ok()?;
        let pipelines = Pipelines::new(&device, COLOR).expect("are accepted");
        Some(Self { device, queue, pipelines })
    }

    fn draw(&self, picture: &mut Picture, frame: &Frame) {
        let Self { device, queue, pipelines } = self;
        picture.draw(pipelines, device, queue, frame, SIZE, 1.0);
    }

    fn pixels(&self, picture: &Picture) -> image::RgbaImage {
        let texture = picture.texture().expect("was drawn");
        // Rows in buffers begin at multiples of 256 bytes; 320 pixels are one.
        let bytes_per_row = 4 * SIZE[0];
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: u64::from(bytes_per_row * SIZE[1]),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = self.device.create_command_encoder(&Default::default());
        encoder.copy_texture_to_buffer(
            texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &buffer,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(bytes_per_row),
                    rows_per_image: None,
                },
            },
            texture.size(),
        );
        self.queue.submit([encoder.finish()]);
        buffer.slice(..).map_async(wgpu::MapMode::Read, |_| ());
        self.device.poll(wgpu::PollType::wait_indefinitely()).expect("finishes");
        let bytes = buffer.slice(..).get_mapped_range().expect("mapped").to_vec();
        image::RgbaImage::from_raw(SIZE[0], SIZE[1], bytes).expect("is whole")
    }
}

fn view_camera() -> ViewCamera {
    let size = egui::vec2(SIZE[0] as f32, SIZE[1] as f32);
    let eye = Pose::new([1.0, -2.0, -5.0].into(), [-0.2, 0.3, 0.1].into());
    ViewCamera::centred(eye, 0.9, size)
}

fn frame(points: &[Spot], lines: Vec<Line>) -> Frame {
    Frame {
        view_camera: view_camera(),
        background: BLACK,
        points: Arc::new(Points::new(points.iter().copied())),
        lines,
    }
}

/// The point of the scene that the view camera sees at `x`, `y` \[pixels\] and a depth.
fn place(x: f64, y: f64, depth: f64) -> [f32; 3] {
    let view_camera = view_camera();
    let in_eye = Point3::new(
        (x - view_camera.centre[0]) / view_camera.focal[0] * depth,
        (y - view_camera.centre[1]) / view_camera.focal[1] * depth,
        depth,
    );
    (view_camera.scene_from_eye * in_eye).coords.cast::<f32>().into()
}

fn near_pixel(picture: &image::RgbaImage, x: f64, y: f64) -> Color32 {
    let [r, g, b, a] = picture.get_pixel(x as u32, y as u32).0;
    Color32::from_rgba_premultiplied(r, g, b, a)
}

#[test]
fn points_are_drawn_where_the_lens_sees_them_and_the_nearer_one_wins() {
    let Some(card) = Card::any() else { return };
    let places = (4.0..316.0_f64, 4.0..236.0_f64, 1.0..80.0_f64, 0.05..0.5_f64, prop::bool::ANY);
    let mut runner = TestRunner::new(Config::with_cases(24));
    runner
        .run(&places, |(x, y, depth, behind, first)| {
            // The middle of a pixel: a point of 1.5 pixels surely covers it.
            let (x, y) = (x.floor() + 0.5, y.floor() + 0.5);
            let near = Spot { at: place(x, y, depth), color: GREEN };
            let far = Spot { at: place(x, y, depth * (1.0 + behind)), color: RED };
            let points = if first { [near, far] } else { [far, near] };
            let mut picture = Picture::default();
            card.draw(&mut picture, &frame(&points, Vec::new()));
            prop_assert_eq!(picture.trouble(), None);
            let pixels = card.pixels(&picture);
            let seen = near_pixel(&pixels, x, y);
            prop_assert_eq!(seen, GREEN);
            Ok(())
        })
        .expect("holds");
}

#[test]
fn a_line_from_behind_the_eye_is_drawn_as_far_as_it_is_seen() {
    let Some(card) = Card::any() else { return };
    let mut picture = Picture::default();
    // Through the place seen at (200, 100) 4 m ahead, from a place behind the eye.
    let [a, b] = [place(120.0, 140.0, -3.0), place(200.0, 100.0, 4.0)];
    let on = |share: f32| std::array::from_fn(|axis| a[axis] + share * (b[axis] - a[axis]));
    let line = Line { ends: [a, on(2.0)], color: GREEN, width: 3.0 };
    card.draw(&mut picture, &frame(&[], vec![line]));
    let pixels = card.pixels(&picture);
    for share in [0.8, 1.0, 1.5] {
        let place: [f32; 3] = on(share);
        let at = view_camera().project(&Point3::from(place).cast()).expect("in front");
        let seen = near_pixel(&pixels, f64::from(at.x), f64::from(at.y));
        assert_eq!(seen, GREEN, "{share}: {at:?}");
    }
    assert_eq!(near_pixel(&pixels, 20.0, 20.0), BLACK);
}

#[test]
fn a_picture_is_drawn_again_only_if_something_changed() {
    let Some(card) = Card::any() else { return };
    let mut picture = Picture::default();
    let point = Spot { at: place(50.0, 50.0, 3.0), color: RED };
    let first = frame(&[point], Vec::new());
    assert!(!picture.shows(&first, SIZE, 1.0));
    card.draw(&mut picture, &first);
    assert!(picture.shows(&first.clone(), SIZE, 1.0));
    let mut moved = first.clone();
    moved.view_camera.centre[0] += 3.0;
    assert!(!picture.shows(&moved, SIZE, 1.0));
    assert!(!picture.shows(&first, [10, 10], 1.0) && !picture.shows(&first, SIZE, 2.0));
    // Other points are other points, even at the same places.
    assert!(!picture.shows(&frame(&[point], Vec::new()), SIZE, 1.0));
}

#[test]
fn a_line_is_before_or_behind_a_point() {
    let Some(card) = Card::any() else { return };
    let mut picture = Picture::default();
    let point = Spot { at: place(50.5, 50.5, 3.0), color: RED };
    for (depth, color) in [(2.0, GREEN), (5.0, RED)] {
        let line = Line {
            ends: [place(20.0, 50.5, depth), place(80.0, 50.5, depth)],
            color: GREEN,
            width: 6.0,
        };
        card.draw(&mut picture, &frame(&[point], vec![line]));
        let pixels = card.pixels(&picture);
        assert_eq!(near_pixel(&pixels, 50.0, 50.0), color);
        assert_eq!(near_pixel(&pixels, 30.0, 50.0), GREEN);
    }
}

#[test]
fn an_error_of_the_graphics_card_is_reported_and_kills_nothing() {
    let Some(card) = Card::any() else { return };
    let mut picture = Picture::default();
    let Card { device, queue, pipelines } = &card;
    let frame = frame(&[], Vec::new());
    picture.draw(pipelines, device, queue, &frame, [1_000_000, 10], 1.0);
    let why = picture.trouble().expect("is refused");
    assert!(why.contains("1000000"), "{why}");
    // Nothing more is tried.
    card.draw(&mut picture, &frame);
    assert!(picture.trouble().is_some() && picture.texture().is_none());
}
