// A workgroup draws one hypothesis after the other on a slot of its own, which holds a word or two for each
// pixel and is cleared only after every fifteenth: a word of an older hypothesis loses against any of a
// younger one.

const LANES: u32 = 256u;
const AGES: u32 = 15u;

var<workgroup> is_undecided: atomic<u32>;

fn meet() {
    storageBarrier();
    workgroupBarrier();
}

@compute @workgroup_size(256)
fn draw(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let pixels = u32(shape.width * shape.height);
    let slot = group.x * pixels;
    let start = ages[group.x];
    for (var round = 0u; round < shape.rounds; round++) {
        let age = (start + round) % AGES;
        if age == 0u {
            for (var at = lane; at < pixels; at += LANES) {
                atomicStore(&nearest[slot + at], 0u);
                atomicStore(&first[slot + at], 0u);
            }
        }
        let mark = (age + 1u) << 28u;
        let pose = round * groups.x + group.x;
        // The last round may have too few hypotheses for all workgroups.
        let works = pose < shape.poses;
        let count = select(0u, shape.points, works);
        if lane == 0u {
            atomicStore(&is_undecided, 0u);
        }
        begin(lane);
        meet();

        for (var point = lane; point < count; point += LANES) {
            let s = seen(pose, point);
            if s.is_too_far {
                atomicStore(&is_undecided, 1u);
            }
            if s.is_in_view {
                let columns = vec2(max(s.column - shape.reach, 0), min(s.column + shape.reach, shape.width - 1));
                for (var row = max(s.row - shape.reach, 0); row <= min(s.row + shape.reach, shape.height - 1); row++) {
                    for (var column = columns.x; column <= columns.y; column++) {
                        let at = slot + u32(row * shape.width + column);
                        atomicMax(&nearest[at], mark | (MOST - s.depth));
                    }
                }
            }
        }
        meet();

        for (var point = lane; point < count; point += LANES) {
            let s = seen(pose, point);
            if s.is_in_view {
                let columns = vec2(max(s.column - shape.reach, 0), min(s.column + shape.reach, shape.width - 1));
                for (var row = max(s.row - shape.reach, 0); row <= min(s.row + shape.reach, shape.height - 1); row++) {
                    for (var column = columns.x; column <= columns.y; column++) {
                        let at = slot + u32(row * shape.width + column);
                        if atomicLoad(&nearest[at]) == (mark | (MOST - s.depth)) {
                            atomicMax(&first[at], mark | (MOST - point));
                        }
                    }
                }
            }
        }
        meet();

        for (var point = lane; point < count; point += LANES) {
            let s = seen(pose, point);
            if s.is_in_view {
                let columns = vec2(max(s.column - shape.reach, 0), min(s.column + shape.reach, shape.width - 1));
                for (var row = max(s.row - shape.reach, 0); row <= min(s.row + shape.reach, shape.height - 1); row++) {
                    for (var column = columns.x; column <= columns.y; column++) {
                        let pixel = u32(row * shape.width + column);
                        let at = slot + pixel;
                        if atomicLoad(&nearest[at]) == (mark | (MOST - s.depth))
                            && atomicLoad(&first[at]) == (mark | (MOST - point)) {
                            tally(slot, pixel, points[point].w);
                        }
                    }
                }
            }
        }
        meet();

        finish(slot, pose, lane, works);
        meet();
    }
    if lane == 0u {
        ages[group.x] = (start + shape.rounds) % AGES;
    }
}
