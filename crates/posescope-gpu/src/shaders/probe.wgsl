// What the shaders compute for a point, told number by number.

@compute @workgroup_size(64)
fn probe(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= shape.points {
        return;
    }
    let s = seen(id.x, id.x);
    let error = squared_difference(bitcast<f32>(query[id.x]), bitcast<f32>(points[id.x].w));
    let at = 6u * id.x;
    answer[at] = select(0u, 1u, s.is_in_view) + select(0u, 2u, s.is_too_far);
    answer[at + 1u] = bitcast<u32>(s.column);
    answer[at + 2u] = bitcast<u32>(s.row);
    answer[at + 3u] = s.depth;
    answer[at + 4u] = bitcast<u32>(error);
    answer[at + 5u] = units(bitcast<u32>(error));
}
