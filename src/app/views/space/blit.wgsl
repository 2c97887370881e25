// Puts the finished picture into the pane, pixel by pixel.

@group(0) @binding(0) var picture: texture_2d<f32>;

struct Seen {
    @builtin(position) clip: vec4f,
    @location(0) uv: vec2f,
}

// One triangle that covers the pane.
@vertex
fn cover(@builtin(vertex_index) index: u32) -> Seen {
    let uv = vec2f(f32((index << 1u) & 2u), f32(index & 2u));
    return Seen(vec4f(uv.x * 2.0 - 1.0, 1.0 - uv.y * 2.0, 0.0, 1.0), uv);
}

fn texel(uv: vec2f) -> vec4f {
    let size = vec2f(textureDimensions(picture));
    let at = clamp(floor(uv * size), vec2f(0.0), size - 1.0);
    return textureLoad(picture, vec2u(at), 0);
}

@fragment
fn encoded(seen: Seen) -> @location(0) vec4f {
    return texel(seen.uv);
}

// For a target that encodes what is written to it.
@fragment
fn linear(seen: Seen) -> @location(0) vec4f {
    let color = texel(seen.uv);
    let low = color.rgb / 12.92;
    let high = pow((color.rgb + 0.055) / 1.055, vec3f(2.4));
    return vec4f(select(high, low, color.rgb <= vec3f(0.04045)), color.a);
}
