//! A card that is open, and what has become of it.

use std::fmt::Display;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, mpsc};
use std::time::Duration;

use wgpu::{BufferUsages, DeviceType};

use crate::adapter::{choose, described};
use crate::failure::GpuError;

/// Beyond this a card that does not answer is taken for lost.
const PATIENCE: Duration = Duration::from_secs(60);

/// An open card.
pub(crate) struct Card {
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
    pub limits: wgpu::Limits,
    pub is_software: bool,
    name: String,
    failure: Arc<Mutex<Option<GpuError>>>,
    /// Why a query was not taken; others may be.
    refusal: Mutex<Option<GpuError>>,
}

impl Card {
    /// Opens a card.
    pub fn open(software_will_do: bool) -> Result<Self, GpuError> {
        let adapter = choose(software_will_do)?;
        let info = adapter.get_info();
        let name = described(&info);
        let limits = adapter.limits();
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("posescope"),
            required_limits: limits.clone(),
            ..wgpu::DeviceDescriptor::default()
        };
        let opened = pollster::block_on(adapter.request_device(&descriptor));
        let (device, queue) = opened
            .map_err(|why| GpuError::NotOpened { name: name.clone(), why: one_line(&why) })?;
        let failure = Arc::new(Mutex::new(None));
        watch(&device, &name, &failure);
        Ok(Self {
            limits,
            is_software: info.device_type == DeviceType::Cpu,
            device,
            queue,
            name,
            failure,
            refusal: Mutex::default(),
        })
    }

    pub fn name(&self) -> &str {
        &self.name
    }

    /// How many hypotheses to hand over at a time: some milliseconds of a card's time.
    pub fn most_at_a_time(&self) -> usize {
        if self.is_software { 256 } else { 4096 }
    }

    /// Why the card is of no use any more.
    pub fn failure(&self) -> Option<GpuError> {
        lock(&self.failure).clone()
    }

    /// Why the processor did what the card was to do, if it did: a failure, or a query that was too large.
    pub fn complaint(&self) -> Option<GpuError> {
        self.failure().or_else(|| lock(&self.refusal).clone())
    }

    /// The card cannot take a query; the first reason stays.
    pub fn refuse(&self, why: GpuError) {
        remember(&self.refusal, why);
    }

    /// The card is of no use any more; the first reason stays.
    pub fn fail(&self, why: GpuError) {
        remember(&self.failure, why);
    }

    /// An empty buffer.
    pub fn buffer(&self, label: &str, bytes: u64, usage: BufferUsages) -> wgpu::Buffer {
        self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: bytes.max(16),
            usage,
            mapped_at_creation: false,
        })
    }

    /// A buffer that the shaders read.
    pub fn filled(&self, label: &str, content: &[u8], usage: BufferUsages) -> wgpu::Buffer {
        let bytes = content.len().next_multiple_of(4) as u64;
        let buffer = self.buffer(label, bytes, usage | BufferUsages::COPY_DST);
        self.queue.write_buffer(&buffer, 0, content);
        buffer
    }

    /// Runs what was encoded, and the first words of `from` after it by way of `staging`, which is as large
    /// at least; `None` where the card was lost.
    pub fn run_and_read(
        &self,
        mut encoder: wgpu::CommandEncoder,
        from: &wgpu::Buffer,
        staging: &wgpu::Buffer,
        words: usize,
    ) -> Option<Vec<u32>> {
        let bytes = 4 * words as u64;
        encoder.copy_buffer_to_buffer(from, 0, staging, 0, bytes);
        let submitted = self.queue.submit([encoder.finish()]);
        let (sender, receiver) = mpsc::channel();
        let answer = staging.slice(..bytes);
        answer.map_async(wgpu::MapMode::Read, move |mapped| {
            // Fails only if the card was lost meanwhile.
            let _ = sender.send(mapped);
        });
        let wait =
            wgpu::PollType::Wait { submission_index: Some(submitted), timeout: Some(PATIENCE) };
        self.device.poll(wait).map_err(|why| self.lost(&why)).ok()?;
        let mapped = receiver.recv().map_err(|why| self.lost(&why)).ok()?;
        mapped.map_err(|why| self.lost(&why)).ok()?;
        let view = answer.get_mapped_range().map_err(|why| self.lost(&why)).ok()?;
        let answer = bytemuck::pod_collect_to_vec(&view);
        drop(view);
        staging.unmap();
        self.failure().is_none().then_some(answer)
    }

    fn lost(&self, why: &dyn Display) {
        self.fail(GpuError::Lost { name: self.name.clone(), why: one_line(why) });
    }
}

/// Remembers what the driver says when nobody asks.
fn watch(device: &wgpu::Device, name: &str, failure: &Arc<Mutex<Option<GpuError>>>) {
    let lost = |why: &dyn Display, name: &str| GpuError::Lost {
        name: name.to_owned(),
        why: one_line(why),
    };
    let (to, of) = (Arc::clone(failure), name.to_owned());
    device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
        remember(&to, lost(&error, &of));
    }));
    let (to, of) = (Arc::clone(failure), name.to_owned());
    device.set_device_lost_callback(move |reason, message| {
        // A device that we gave back ourselves is no loss.
        if reason != wgpu::DeviceLostReason::Destroyed {
            remember(&to, lost(&message, &of));
        }
    });
}

fn remember(failure: &Mutex<Option<GpuError>>, why: GpuError) {
    let mut failure = lock(failure);
    if failure.is_none() {
        log::warn!("{why}; continuing on the processor");
        *failure = Some(why);
    }
}

pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Messages of drivers have many lines.
fn one_line(why: &dyn Display) -> String {
    let text = why.to_string();
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}
