//! For posescope's own crates: may change in any version.
//!
//! One judge for the poses of all methods: what a pose costs where grey values alone do not say it.
//!
//! The cost of MI compares grey values, and light changes them. Two more channels of the same photos hold where grey
//! values do not: the grey value against its surroundings (local contrast), and how strong the edges are. Each hypothesis
//! is drawn once and counted in a joint histogram for each channel; the cost is the mean of 1 − NMI over the channels, each
//! NMI less what chance alone would give. All three lead from far away. Which of two minima is the right one, local
//! contrast alone says best.
//!
//! | file | what |
//! |---|---|
//! | `channels` | what a photo shows, three ways |
//! | `chance` | 1 − NMI less its chance level |
//! | `scorer` | the cost of many poses, on all threads |
//! | `params` | what decides it |

mod chance;
mod channels;
mod params;
mod scorer;

pub use params::{Channels, JudgeParams};
pub use scorer::Judge;
