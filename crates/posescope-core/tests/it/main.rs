//! Integration tests of the estimators: one binary, so that they are linked once.

mod conformance;
mod data;
mod decisions;
mod diagnosis;
mod front_door;
mod memory;
mod methods;
mod one_answer;
mod own_cost;
mod ranking;
mod robust_pose;
mod scene_size;
mod searches;
mod stopping;
mod surf_warp;
mod two_walls;
mod walls_scene;
