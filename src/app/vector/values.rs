//! Numbers, places and colours as SVG writes them.

use egui::{Color32, Pos2, Rect, Stroke};

/// Two decimals where there are any: a hundredth of a point is not seen.
pub(super) fn number(value: f32) -> String {
    let rounded = (100.0 * f64::from(value)).round() / 100.0;
    // A negative zero is no number of its own.
    format!("{}", rounded + 0.0)
}

/// A place as the corner of a path.
pub(super) fn point(at: Pos2) -> String {
    format!("{},{}", number(at.x), number(at.y))
}

/// A rectangle as attributes.
pub(super) fn place(rect: Rect) -> String {
    let [x, y, width, height] = [rect.min.x, rect.min.y, rect.width(), rect.height()].map(number);
    format!("x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\"")
}

/// A turn \[rad\] about a point, if there is any.
pub(super) fn turned(angle: f32, about: Pos2) -> String {
    match angle == 0.0 {
        true => String::new(),
        false => {
            let [degrees, x, y] = [angle.to_degrees(), about.x, about.y].map(number);
            format!(" transform=\"rotate({degrees} {x} {y})\"")
        }
    }
}

/// A colour as the value of an attribute, and how opaque it is.
pub(super) fn color(of: &str, color: Color32) -> String {
    let [r, g, b, a] = color.to_srgba_unmultiplied();
    if a == 0 {
        return format!("{of}=\"none\"");
    }
    let opacity = match a {
        255 => String::new(),
        alpha => format!(" {of}-opacity=\"{}\"", number(f32::from(alpha) / 255.0)),
    };
    format!("{of}=\"#{r:02x}{g:02x}{b:02x}\"{opacity}")
}

/// Fill and stroke as attributes.
pub(super) fn paint(fill: Color32, stroke: &Stroke) -> String {
    let fill = color("fill", fill);
    if stroke.is_empty() {
        return fill;
    }
    let width = number(stroke.width);
    format!(
        "{fill} {} stroke-width=\"{width}\"",
        color("stroke", stroke.color)
    )
}
