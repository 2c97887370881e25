// Where a point falls, in the very numbers of the processor.

struct Shape {
    points: u32,
    // Hypotheses of this batch.
    poses: u32,
    width: i32,
    height: i32,
    // Each point covers so many columns and rows beside its own [px].
    reach: i32,
    // Hypotheses that a workgroup draws, one after the other.
    rounds: u32,
    // Always 0, which no compiler knows.
    zero: u32,
    padding: u32,
}

@group(0) @binding(0) var<uniform> shape: Shape;
// Position [m] as bits of single precision, and what is compared.
@group(0) @binding(1) var<storage, read> points: array<vec4<u32>>;
// What is compared, row by row.
@group(0) @binding(2) var<storage, read> query: array<u32>;
// Three rows for each hypothesis.
@group(0) @binding(3) var<storage, read> poses: array<vec4<f32>>;
// For each slot and pixel the depth that is nearest, the first of the points at it, and room for errors.
@group(0) @binding(4) var<storage, read_write> nearest: array<atomic<u32>>;
@group(0) @binding(5) var<storage, read_write> first: array<atomic<u32>>;
@group(0) @binding(6) var<storage, read_write> errors: array<u32>;
// For each slot how many hypotheses were drawn on it since it was cleared.
@group(0) @binding(7) var<storage, read_write> ages: array<u32>;
@group(0) @binding(8) var<storage, read_write> answer: array<u32>;

// 10 cm; nearer points are not seen.
const NEAREST: i32 = 0x3dcccccd;
// Depths and places take 28 bits, the age of a slot the four above.
const MOST: u32 = 0x0fffffffu;

// Sums and products that pass through here are rounded one by one: no compiler knows that this changes
// nothing, so none may fuse what is before it with what comes after.
fn exact(value: f32) -> f32 {
    return bitcast<f32>(bitcast<u32>(value) ^ shape.zero);
}

fn along(row: vec4<f32>, p: vec3<f32>) -> f32 {
    let x = exact(row.x * p.x);
    let y = exact(row.y * p.y);
    let z = exact(row.z * p.z);
    return exact(exact(exact(x + y) + z) + row.w);
}

// 1 / depth as IEEE 754 rounds it, for depths from 2⁻⁴ to 2³⁰. Cards divide with an error of some units in
// the last place, so what they say is a guess. With the significand m of the depth, that of the quotient is
// the whole number q nearest to 2⁴⁷ / m; the remainder 2⁴⁷ − q m is small, so its lower 32 bits say all.
fn reciprocal(depth: f32) -> f32 {
    let bits = bitcast<u32>(depth);
    let m = (bits & 0x7fffffu) | 0x800000u;
    let exponent = 253u - (bits >> 23u);
    let guess = bitcast<u32>(1.0 / depth);
    let guessed = (guess >> 23u) & 0xffu;
    var q = (guess & 0x7fffffu) | 0x800000u;
    if guessed > exponent {
        q = 0x1000000u;
    } else if guessed < exponent {
        q = 0x800000u;
    }
    let whole = i32(m);
    var rest = bitcast<i32>(0u - q * m);
    for (var i = 0; i < 6; i++) {
        if 2 * rest > whole {
            q += 1u;
            rest -= whole;
        } else if 2 * rest < -whole {
            q -= 1u;
            rest += whole;
        }
    }
    // The quotient is 2²⁴ where the depth is a power of two.
    if q > 0xffffffu {
        return bitcast<f32>((exponent + 1u) << 23u);
    }
    return bitcast<f32>((exponent << 23u) | (q & 0x7fffffu));
}

struct Seen {
    is_in_view: bool,
    // Whether the card has too few bits for the depth.
    is_too_far: bool,
    column: i32,
    row: i32,
    // Above that at which points begin to be seen, in units of the last place.
    depth: u32,
}

fn seen(pose: u32, point: u32) -> Seen {
    var result: Seen;
    let p = bitcast<vec3<f32>>(points[point].xyz);
    let depth = along(poses[3u * pose + 2u], p);
    let bits = bitcast<i32>(depth);
    // Of positive numbers the bits are in the order of the numbers, and below them are the negative ones.
    if bits <= NEAREST {
        return result;
    }
    result.depth = u32(bits - NEAREST);
    if result.depth > MOST {
        result.is_too_far = true;
        return result;
    }
    let inverse = reciprocal(depth);
    let column = floor(exact(exact(along(poses[3u * pose], p) * inverse) + 0.5));
    let row = floor(exact(exact(along(poses[3u * pose + 1u], p) * inverse) + 0.5));
    let reach = f32(shape.reach);
    result.is_in_view = column >= -reach && row >= -reach
        && column < f32(shape.width + shape.reach) && row < f32(shape.height + shape.reach);
    if result.is_in_view {
        result.column = i32(column);
        result.row = i32(row);
    }
    return result;
}

// (I_Q − I_S)², rounded as the processor rounds it.
fn squared_difference(of_query: f32, of_point: f32) -> f32 {
    let difference = exact(of_query - of_point);
    return exact(difference * difference);
}

// A number below 2¹⁶ in units of 2⁻¹⁶; of two as near the even one.
fn units(bits: u32) -> u32 {
    let exponent = i32(bits >> 23u) - 134;
    let m = (bits & 0x7fffffu) | 0x800000u;
    if exponent >= 0 {
        return m << u32(min(exponent, 8));
    }
    let shift = u32(-exponent);
    if shift > 24u {
        return 0u;
    }
    let whole = m >> shift;
    let rest = m & ((1u << shift) - 1u);
    let half = 1u << (shift - 1u);
    let is_up = rest > half || (rest == half && (whole & 1u) == 1u);
    return whole + select(0u, 1u, is_up);
}
