// The joint histogram. BINS is written above by whoever compiles this.

const CELLS: u32 = BINS * BINS;
// The counts, and whether they are to be believed.
const WORDS: u32 = CELLS + 1u;

var<workgroup> histogram: array<atomic<u32>, CELLS>;

fn begin(lane: u32) {
    for (var cell = lane; cell < CELLS; cell += LANES) {
        atomicStore(&histogram[cell], 0u);
    }
}

// The query's bins are four to a word.
fn tally(slot: u32, pixel: u32, of_point: u32) {
    let of_query = extractBits(query[pixel / 4u], 8u * (pixel % 4u), 8u);
    atomicAdd(&histogram[of_query * BINS + of_point], 1u);
}

fn finish(slot: u32, pose: u32, lane: u32, works: bool) {
    if works {
        for (var cell = lane; cell < CELLS; cell += LANES) {
            answer[pose * WORDS + cell] = atomicLoad(&histogram[cell]);
        }
        if lane == 0u {
            answer[pose * WORDS + CELLS] = atomicLoad(&is_undecided);
        }
    }
}
