//! Windows that are really painted, and how far their pictures can be compared with the stored ones.

use eframe::egui_wgpu::{RenderState, RendererOptions, WgpuConfiguration};
use egui_kittest::wgpu::{WgpuTestRenderer, default_wgpu_setup};
use egui_kittest::{Harness, SnapshotOptions};
use image::RgbaImage;
use image::imageops::{FilterType, resize};
use posescope::app::{App, Setup};

/// A window with something to paint it.
pub struct PaintedWindow {
    pub window: Harness<'static, App>,
    pub judge: SnapshotComparison,
}

/// Holds pictures against the stored ones.
pub struct SnapshotComparison {
    adapter: wgpu::AdapterInfo,
    /// Pictures that were compared coarsely.
    coarsely: usize,
}

/// The adapter that the tests paint with, and its device; `None` where there is none.
fn render_state() -> Option<RenderState> {
    let setup = default_wgpu_setup();
    let instance = pollster::block_on(setup.new_instance());
    let configuration = WgpuConfiguration { wgpu_setup: setup, ..WgpuConfiguration::default() };
    let options = RendererOptions::PREDICTABLE;
    pollster::block_on(RenderState::create(&configuration, &instance, None, options)).ok()
}

fn words_of(info: &wgpu::AdapterInfo) -> String {
    format!("{:?}, {}, {}", info.backend, info.name, info.driver_info)
}

/// A painted window; `None`, and a line that says so, where there is nothing to paint with.
pub fn painted(setup: Setup, size: [f32; 2]) -> Option<PaintedWindow> {
    let Some(state) = render_state() else {
        println!("skipped: no graphics adapter; Mesa's software Vulkan is one");
        return None;
    };
    let adapter = state.adapter.get_info();
    println!("painted by {}", words_of(&adapter));
    let window = Harness::builder()
        .with_size(size)
        .renderer(WgpuTestRenderer::from_render_state(state))
        .build_eframe(|creation| App::new(creation, setup));
    Some(PaintedWindow { window, judge: SnapshotComparison { adapter, coarsely: 0 } })
}

impl SnapshotComparison {
    /// Whether this is the rasterizer that painted the stored pictures: only its pixels can be
    /// compared one by one.
    fn painted_the_stored(&self) -> bool {
        self.adapter.backend == wgpu::Backend::Vulkan && self.adapter.name.contains("llvmpipe")
    }

    /// Compares the window with its stored picture: pixel by pixel where the same rasterizer painted
    /// it, in its broad lines elsewhere.
    pub fn compare(&mut self, window: &mut Harness<'_, App>, name: &str) -> Result<(), String> {
        if self.painted_the_stored() {
            // Glyph edges and points differ by little from one version to the next.
            let options = SnapshotOptions::new().threshold(2.0).max_failed_pixels(900);
            let compared = window.try_snapshot_options(name, &options);
            return compared.map_err(|error| error.to_string());
        }
        self.coarsely += 1;
        let picture = window.render()?;
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/snapshots");
        let stored = image::open(format!("{folder}/{name}.png")).map_err(|why| why.to_string())?;
        let off = share_off(&picture, &stored.into_rgba8());
        if off <= COARSE_SHARE {
            return Ok(());
        }
        let new = format!("{folder}/{name}.new.png");
        picture.save(&new).map_err(|why| why.to_string())?;
        Err(format!(
            "{name}: {:.1} % of the picture is unlike the stored one, at most {:.1} % may be; see {new}",
            100.0 * off,
            100.0 * COARSE_SHARE,
        ))
    }
}

impl Drop for SnapshotComparison {
    fn drop(&mut self) {
        if self.coarsely > 0 {
            println!(
                "{} pictures compared in blocks of {BLOCK} x {BLOCK} px, not pixel by pixel: {} did \
                 not paint the stored ones",
                self.coarsely,
                words_of(&self.adapter)
            );
        }
    }
}

/// Side of the blocks whose mean colours are compared across rasterizers \[px\].
const BLOCK: u32 = 4;
/// How far the mean of a block may be off, of 255: an edge or a glyph that lies half a pixel
/// elsewhere stays below, a missing line does not.
const BLOCK_OFF: u8 = 40;
/// Share of a picture's blocks that may be off farther. Mesa's OpenGL has at most 0.2 %; without
/// the cloud the 3-D view has 3 %.
const COARSE_SHARE: f64 = 0.005;

/// Share of the blocks whose colours differ.
fn share_off(picture: &RgbaImage, stored: &RgbaImage) -> f64 {
    assert_eq!(picture.dimensions(), stored.dimensions());
    let (width, height) = (picture.width() / BLOCK, picture.height() / BLOCK);
    let small = |image| resize(image, width, height, FilterType::Triangle);
    let (picture, stored) = (small(picture), small(stored));
    let is_off = |(a, b): &(&image::Rgba<u8>, &image::Rgba<u8>)| {
        a.0.iter().zip(b.0).any(|(a, b)| a.abs_diff(b) > BLOCK_OFF)
    };
    let off = picture.pixels().zip(stored.pixels()).filter(is_off).count();
    off as f64 / f64::from(width * height)
}
