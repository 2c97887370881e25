//! Integration tests: one binary, because each would link the whole of Rerun again.

mod bad_input;
mod binary;
mod command_line;
mod conformance;
mod data;
mod decisions;
mod evaluation;
mod frame_cache;
mod kitti;
mod looks;
mod painted;
mod picture_views;
mod real_pair;
mod recording;
mod reference_views;
mod retrieval;
mod robust_pose;
mod search_views;
mod session;
mod small_sequence;
mod space;
mod surf_warp;
mod synth;
mod two_walls;
mod walls_scene;
mod window;
