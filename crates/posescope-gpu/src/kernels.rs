//! The shaders, compiled as they are needed.

use std::collections::HashMap;
use std::sync::{Arc, Mutex};

use wgpu::{BindingType, BufferBindingType, ComputePipeline, ShaderStages};

use crate::card::{Card, lock};

const PROJECT: &str = include_str!("shaders/project.wgsl");
const DRAW: &str = include_str!("shaders/draw.wgsl");
const COUNTS: &str = include_str!("shaders/counts.wgsl");
const HALF: &str = include_str!("shaders/half.wgsl");
const PROBE: &str = include_str!("shaders/probe.wgsl");

/// What the shaders know of a batch, as `Shape` in `shaders/project.wgsl` has it.
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct Shape {
    pub points: u32,
    pub poses: u32,
    pub width: u32,
    pub height: u32,
    pub reach: u32,
    pub rounds: u32,
    pub zero: u32,
    pub padding: u32,
}

/// What a shader finds out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Kernel {
    /// The joint histogram with so many bins per axis.
    Counts {
        /// Bins per axis.
        bins: u32,
    },
    /// Number and sum of the errors up to their median.
    LesserHalf,
    /// Where points fall, to be compared.
    Probe,
}

impl Kernel {
    fn source(self) -> String {
        match self {
            Self::Counts { bins } => format!("const BINS: u32 = {bins}u;\n{PROJECT}{DRAW}{COUNTS}"),
            Self::LesserHalf => format!("{PROJECT}{DRAW}{HALF}"),
            Self::Probe => format!("{PROJECT}{PROBE}"),
        }
    }

    fn entry_point(self) -> &'static str {
        match self {
            Self::Counts { .. } | Self::LesserHalf => "draw",
            Self::Probe => "probe",
        }
    }
}

/// The shaders of a card.
pub(crate) struct Kernels {
    bindings: wgpu::BindGroupLayout,
    layout: wgpu::PipelineLayout,
    compiled: Mutex<HashMap<Kernel, Arc<ComputePipeline>>>,
}

impl Kernels {
    pub fn new(device: &wgpu::Device) -> Self {
        let storage = |read_only| BufferBindingType::Storage { read_only };
        let kinds = [
            BufferBindingType::Uniform,
            storage(true),
            storage(true),
            storage(true),
            storage(false),
            storage(false),
            storage(false),
            storage(false),
            storage(false),
        ];
        let entries: Vec<_> = (0..)
            .zip(kinds)
            .map(|(binding, ty)| wgpu::BindGroupLayoutEntry {
                binding,
                visibility: ShaderStages::COMPUTE,
                ty: BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None },
                count: None,
            })
            .collect();
        let bindings = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("hypotheses"),
            entries: &entries,
        });
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("hypotheses"),
            bind_group_layouts: &[Some(&bindings)],
            immediate_size: 0,
        });
        Self { bindings, layout, compiled: Mutex::default() }
    }

    /// A shader, ready to run.
    fn get(&self, device: &wgpu::Device, kernel: Kernel) -> Arc<ComputePipeline> {
        let compile = || {
            let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some(kernel.entry_point()),
                source: wgpu::ShaderSource::Wgsl(kernel.source().into()),
            });
            Arc::new(device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(kernel.entry_point()),
                layout: Some(&self.layout),
                module: &module,
                entry_point: Some(kernel.entry_point()),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                cache: None,
            }))
        };
        let mut compiled = lock(&self.compiled);
        Arc::clone(compiled.entry(kernel).or_insert_with(compile))
    }

    /// A shader on its buffers, in the order of their bindings.
    pub fn encoded(
        &self,
        card: &Card,
        kernel: Kernel,
        buffers: [&wgpu::Buffer; 9],
        groups: u32,
    ) -> wgpu::CommandEncoder {
        let entries: Vec<_> = (0..)
            .zip(buffers)
            .map(|(binding, buffer)| wgpu::BindGroupEntry {
                binding,
                resource: buffer.as_entire_binding(),
            })
            .collect();
        let device = &card.device;
        let bound = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("hypotheses"),
            layout: &self.bindings,
            entries: &entries,
        });
        let pipeline = self.get(device, kernel);
        let mut encoder = device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("hypotheses") });
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("hypotheses"),
            timestamp_writes: None,
        });
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &bound, &[]);
        pass.dispatch_workgroups(groups, 1, 1);
        drop(pass);
        encoder
    }
}
