//! Whether a card computes as the processor does: some thousand points, number by number.

use wgpu::BufferUsages;

use crate::card::Card;
use crate::kernels::{Kernel, Kernels, Shape};

/// Points that are asked for.
const POINTS: usize = 1 << 14;
/// Points of a workgroup.
const LANES: usize = 64;
const SIZE: [u32; 2] = [1241, 376];
const WORDS: usize = 6;
/// 10 cm, from where on points are seen.
const NEAREST_M: f32 = 0.1;

/// A point, its projection, and two values that are compared.
#[derive(Clone, Copy)]
struct Question {
    point: [f32; 3],
    rows: [[f32; 4]; 3],
    values: [f32; 2],
}

/// Whether the card gives the processor's numbers.
pub(crate) fn is_exact(card: &Card, kernels: &Kernels) -> bool {
    let questions = questions();
    let Some(answers) = answers_to(card, kernels, &questions) else {
        return false;
    };
    questions
        .iter()
        .zip(answers.chunks(WORDS))
        .all(|(question, answer)| question.answer() == answer)
}

/// The same on every computer: cameras in front of, beside and behind points, at all scales.
fn questions() -> Vec<Question> {
    // A multiplicative generator, of which the upper bits are used.
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut drawn = |least: f32, most: f32| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        let share = (state >> 40) as f32 / (1_u64 << 24) as f32;
        least + (most - least) * share
    };
    (0..POINTS)
        .map(|place| {
            let (sin, cos) = drawn(-3.2, 3.2).sin_cos();
            let [focal, centre] = [drawn(200.0, 900.0), drawn(100.0, 700.0)];
            let [right, down, ahead] = [drawn(-30.0, 30.0), drawn(-2.0, 2.0), drawn(-30.0, 30.0)];
            let depth = [cos, drawn(-0.1, 0.1), sin, ahead];
            let across = [-sin, 0.0, cos, right];
            let along = [0.0, 1.0, drawn(-0.1, 0.1), down];
            let row = |of: [f32; 4]| std::array::from_fn(|c| focal * of[c] + centre * depth[c]);
            // Near and far, and now and then at powers of two, whose inverses are exact.
            let reach = [1.0, 10.0, 80.0, 4000.0][place % 4];
            // A street is flat: of points all around hardly any would be in view.
            let mut point =
                [drawn(-reach, reach), drawn(-0.1 * reach, 0.1 * reach), drawn(-reach, reach)];
            let mut rows = [row(across), row(along), depth];
            if place % 64 == 0 {
                point = [drawn(-1.0, 1.0), drawn(-1.0, 1.0), (1 << (place / 64 % 8)) as f32];
                rows[2] = [0.0, 0.0, 1.0, 0.0];
            }
            Question { point, rows, values: [drawn(0.0, 255.0), drawn(0.0, 255.0)] }
        })
        .collect()
}

impl Question {
    /// What the processor finds, by the arithmetic of the core's projection.
    fn answer(&self) -> [u32; WORDS] {
        let [x, y, z] = self.point;
        let along = |row: &[f32; 4]| row[0] * x + row[1] * y + row[2] * z + row[3];
        let [query, synthetic] = self.values;
        let difference = query - synthetic;
        let error = difference * difference;
        // Of two units as near the even one, as adding a large number and taking it away does.
        let rounding = 1.5 * (1_u64 << 36) as f64;
        let units = ((f64::from(error) + rounding) - rounding) * 65_536.0;
        let mut answer = [0, 0, 0, 0, error.to_bits(), units as u32];
        let depth = along(&self.rows[2]);
        if depth > NEAREST_M {
            answer[3] = depth.to_bits() - NEAREST_M.to_bits();
            let inverse = 1.0 / depth;
            let column = (along(&self.rows[0]) * inverse + 0.5).floor();
            let row = (along(&self.rows[1]) * inverse + 0.5).floor();
            let [width, height] = SIZE.map(|side| side as f32);
            if column >= 0.0 && row >= 0.0 && column < width && row < height {
                answer[..3].copy_from_slice(&[1, column as u32, row as u32]);
            }
        }
        answer
    }
}

fn answers_to(card: &Card, kernels: &Kernels, questions: &[Question]) -> Option<Vec<u32>> {
    let storage = BufferUsages::STORAGE;
    let filled = |content: &[u8]| card.filled("probe", content, storage);
    let points: Vec<[u32; 4]> = questions
        .iter()
        .map(|question| {
            let [x, y, z] = question.point;
            [x, y, z, question.values[1]].map(f32::to_bits)
        })
        .collect();
    let values: Vec<f32> = questions.iter().map(|question| question.values[0]).collect();
    let rows: Vec<_> = questions.iter().map(|question| question.rows).collect();
    let shape = Shape {
        points: questions.len() as u32,
        poses: questions.len() as u32,
        width: SIZE[0],
        height: SIZE[1],
        reach: 0,
        rounds: 1,
        zero: 0,
        padding: 0,
    };
    let words = WORDS * questions.len();
    let bytes = 4 * words as u64;
    let answer = card.buffer("probe", bytes, storage | BufferUsages::COPY_SRC);
    let staging = card.buffer("probe", bytes, BufferUsages::MAP_READ | BufferUsages::COPY_DST);
    let unused = [0; 4].map(|bytes| card.buffer("unused", bytes, storage));
    let [nearest, first, errors, ages] = &unused;
    let buffers = [
        &card.filled("probe", bytemuck::bytes_of(&shape), BufferUsages::UNIFORM),
        &filled(bytemuck::cast_slice(&points)),
        &filled(bytemuck::cast_slice(&values)),
        &filled(bytemuck::cast_slice(&rows)),
        nearest,
        first,
        errors,
        ages,
        &answer,
    ];
    let groups = questions.len().div_ceil(LANES) as u32;
    let encoder = kernels.encoded(card, Kernel::Probe, buffers, groups);
    card.run_and_read(encoder, &answer, &staging, words)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn questions_have_points_in_view_out_of_it_behind_and_far_away() {
        let answers: Vec<_> = questions().iter().map(Question::answer).collect();
        let share = |is: &dyn Fn(&[u32; WORDS]) -> bool| {
            answers.iter().filter(|answer| is(answer)).count() as f64 / answers.len() as f64
        };
        assert!(share(&|answer| answer[0] == 1) > 0.1);
        assert!(share(&|answer| answer[0] == 0 && answer[3] > 0) > 0.1);
        assert!(share(&|answer| answer[3] == 0) > 0.3);
    }
}
