// Points and lines of the scene. Colours are premultiplied and in the encoding of the screen,
// as egui has them; depth is 1 at the near plane and 0 at infinity.

struct View {
    clip_from_scene: mat4x4f,
    // Size of the picture [px].
    size: vec2f,
    // Least and greatest size of a point [px].
    point_px: vec2f,
    // Size of a point one metre away [px].
    point_scale: f32,
    // Pixels for one of egui's points.
    scale: f32,
    near: f32,
}

@group(0) @binding(0) var<uniform> view: View;

struct Seen {
    @builtin(position) clip: vec4f,
    @location(0) color: vec4f,
}

fn corner(index: u32) -> vec2f {
    return vec2f(f32(index & 1u), f32(index >> 1u)) * 2.0 - 1.0;
}

// A square around a point.
@vertex
fn point(
    @builtin(vertex_index) index: u32,
    @location(0) position: vec3f,
    @location(1) color: vec4f,
) -> Seen {
    var clip = view.clip_from_scene * vec4f(position, 1.0);
    let px = clamp(view.point_scale / clip.w, view.point_px.x, view.point_px.y);
    clip += vec4f(corner(index) * px / view.size * clip.w, 0.0, 0.0);
    return Seen(clip, color);
}

struct Stroke {
    @builtin(position) clip: vec4f,
    @location(0) color: vec4f,
    // Distance from the middle of the line [px], and where it ends, both times w with w itself: so they
    // change evenly on the screen.
    @location(1) across: vec3f,
}

// A stroke of the same width everywhere, between two points.
@vertex
fn line(
    @builtin(vertex_index) index: u32,
    @location(0) begin: vec3f,
    @location(1) end: vec3f,
    @location(2) color: vec4f,
    @location(3) width: f32,
) -> Stroke {
    var a = view.clip_from_scene * vec4f(begin, 1.0);
    var b = view.clip_from_scene * vec4f(end, 1.0);
    // What is behind the eye has no place in the picture: cut it off at the near plane.
    if a.w < view.near && b.w < view.near {
        return Stroke(vec4f(0.0, 0.0, -1.0, 1.0), color, vec3f(1.0));
    }
    if a.w < view.near {
        a = mix(a, b, (view.near - a.w) / (b.w - a.w));
    } else if b.w < view.near {
        b = mix(b, a, (view.near - b.w) / (a.w - b.w));
    }
    let to_px = 0.5 * view.size;
    let along = (b.xy / b.w - a.xy / a.w) * to_px;
    let reach = max(length(along), 1e-6);
    let across = vec2f(-along.y, along.x) / reach;
    let at = corner(index);
    var clip = select(a, b, at.x > 0.0);
    // Half a pixel more for the soft edge.
    let half = 0.5 * width * view.scale + 0.5;
    clip += vec4f(across * at.y * half / to_px * clip.w, 0.0, 0.0);
    return Stroke(clip, color, vec3f(at.y * half, half, 1.0) * clip.w);
}

@fragment
fn paint(seen: Seen) -> @location(0) vec4f {
    return seen.color;
}

@fragment
fn stroke(seen: Stroke) -> @location(0) vec4f {
    let covered = (seen.across.y - abs(seen.across.x)) / seen.across.z;
    return seen.color * clamp(covered, 0.0, 1.0);
}
