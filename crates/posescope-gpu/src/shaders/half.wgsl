// Number and sum of the errors that are at most their lower median. The median is found digit by digit, of
// 11, 11 and 10 bits: errors are not negative, so their bits are in their order.

// Covered pixels, errors that count, four limbs of their sum, and whether that is to be believed.
const WORDS: u32 = 7u;
const DIGITS: u32 = 2048u;
const DIGITS_OF_LANE: u32 = 8u;

var<workgroup> covered: atomic<u32>;
var<workgroup> counted: atomic<u32>;
// Of 16 bits each, with room to carry.
var<workgroup> limbs: array<atomic<u32>, 4>;
var<workgroup> histogram: array<atomic<u32>, DIGITS>;
var<workgroup> up_to: array<u32, LANES>;
// The digits of the median that are known, and how many errors with these digits are below it.
var<workgroup> median: u32;
var<workgroup> rank: u32;

fn begin(lane: u32) {
    if lane == 0u {
        atomicStore(&covered, 0u);
        atomicStore(&counted, 0u);
        for (var limb = 0u; limb < 4u; limb++) {
            atomicStore(&limbs[limb], 0u);
        }
    }
}

fn tally(slot: u32, pixel: u32, of_point: u32) {
    let error = squared_difference(bitcast<f32>(query[pixel]), bitcast<f32>(of_point));
    errors[slot + atomicAdd(&covered, 1u)] = bitcast<u32>(error);
}

fn find_digit(slot: u32, count: u32, lane: u32, shift: u32, known: u32) {
    for (var digit = lane; digit < DIGITS; digit += LANES) {
        atomicStore(&histogram[digit], 0u);
    }
    let prefix = median;
    workgroupBarrier();
    for (var i = lane; i < count; i += LANES) {
        let error = errors[slot + i];
        if (error & known) == prefix {
            atomicAdd(&histogram[(error >> shift) % DIGITS], 1u);
        }
    }
    workgroupBarrier();
    var own = 0u;
    for (var i = 0u; i < DIGITS_OF_LANE; i++) {
        own += atomicLoad(&histogram[DIGITS_OF_LANE * lane + i]);
    }
    up_to[lane] = own;
    workgroupBarrier();
    for (var distance = 1u; distance < LANES; distance *= 2u) {
        var before = 0u;
        if lane >= distance {
            before = up_to[lane - distance];
        }
        workgroupBarrier();
        up_to[lane] += before;
        workgroupBarrier();
    }
    let wanted = rank;
    var below = up_to[lane] - own;
    let has_it = below <= wanted && wanted < up_to[lane];
    workgroupBarrier();
    if has_it {
        for (var i = 0u; i < DIGITS_OF_LANE; i++) {
            let digit = DIGITS_OF_LANE * lane + i;
            let here = atomicLoad(&histogram[digit]);
            if wanted < below + here {
                median = prefix | (digit << shift);
                rank = wanted - below;
                break;
            }
            below += here;
        }
    }
    workgroupBarrier();
}

fn finish(slot: u32, pose: u32, lane: u32, works: bool) {
    let count = atomicLoad(&covered);
    if lane == 0u {
        median = 0u;
        rank = (max(count, 1u) - 1u) / 2u;
    }
    workgroupBarrier();
    find_digit(slot, count, lane, 21u, 0u);
    find_digit(slot, count, lane, 10u, 0xffe00000u);
    // The last digit has ten bits; the eleventh is known already.
    find_digit(slot, count, lane, 0u, 0xfffffc00u);
    let threshold = median;

    var own = 0u;
    var sum = 0u;
    var carried = 0u;
    for (var i = lane; i < count; i += LANES) {
        let error = errors[slot + i];
        if error <= threshold {
            let more = units(error);
            sum += more;
            carried += select(0u, 1u, sum < more);
            own += 1u;
        }
    }
    atomicAdd(&counted, own);
    atomicAdd(&limbs[0], sum & 0xffffu);
    atomicAdd(&limbs[1], sum >> 16u);
    atomicAdd(&limbs[2], carried & 0xffffu);
    atomicAdd(&limbs[3], carried >> 16u);
    workgroupBarrier();
    if works && lane == 0u {
        answer[pose * WORDS] = count;
        answer[pose * WORDS + 1u] = atomicLoad(&counted);
        for (var limb = 0u; limb < 4u; limb++) {
            answer[pose * WORDS + 2u + limb] = atomicLoad(&limbs[limb]);
        }
        answer[pose * WORDS + 6u] = atomicLoad(&is_undecided);
    }
}
