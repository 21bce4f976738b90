//! Pictures: sections through the field, as the run draws them, and the place of the 3D view.

use std::fmt::Write as _;

use super::Report;
use super::html::escape;
use super::scene::SceneData;
use super::shell::packed;
use super::tables::step_label;
use crate::section::section_file;

/// The total length, bytes, up to which pictures stand in the page as they are; longer ones are compressed,
/// and unpacked by its script.
const PLAIN: usize = 900_000;

/// The sections of the first and the last step; `None` where the run drew none.
pub(super) fn sections(report: &Report<'_>) -> Option<String> {
    let pictures: Vec<_> = (report.outcome.steps.iter())
        .flat_map(|step| report.fields.sections(step.index).iter().enumerate().map(move |svg| (step, svg)))
        .collect();
    if pictures.is_empty() {
        return None;
    }
    let is_plain = pictures.iter().map(|(_, (_, svg))| svg.len()).sum::<usize>() <= PLAIN;
    let mut out = "<p>Potential in a plane, in V, in the deformed state; which plane it is stands below each picture. Lines join places of equal \
                   potential, arrows point along the field.</p>\n<div class=\"sections\">\n"
        .to_owned();
    for (step, (number, svg)) in pictures {
        let caption = escape(&format!("Step {}, {}", step.index, step_label(report.outcome, step)));
        let picture = untitled(svg);
        let _ = match is_plain {
            true => writeln!(
                out,
                "<figure class=\"section\">{picture}<figcaption>{caption}</figcaption></figure>"
            ),
            false => writeln!(
                out,
                "<figure class=\"section\"><div class=\"packed\" data-svg=\"{}\">This picture is in {}, too.</div>\
                 <figcaption>{caption}</figcaption></figure>",
                packed(picture.as_bytes()),
                section_file(step.index, number)
            ),
        };
    }
    out.push_str("</div>\n");
    Some(out)
}

/// The picture without its title, which the text alternative and the caption repeat.
fn untitled(svg: &str) -> String {
    const TITLE: &str = "font-weight=\"bold\"";
    let Some((head, rest)) = svg.split_once('\n') else { return svg.to_owned() };
    // Title lines stand near the top, one for each line of the file.
    let lines = rest.lines().take(5).filter(|line| line.contains(TITLE)).count();
    let cut = 18.0 * 1.35 * lines as f64;
    let height =
        |head: &str| -> Option<f64> { head.split("height=\"").nth(1)?.split('"').next()?.parse().ok() };
    let Some(height) = height(head) else { return svg.to_owned() };
    let view_box =
        format!("viewBox=\"0 0 800 {}\" width=\"800\" height=\"{}\"", number(height), number(height));
    let cropped = format!("viewBox=\"0 {} 800 {}\"", number(cut), number(height - cut));
    let rest: String =
        rest.lines().filter(|line| !line.contains(TITLE)).flat_map(|line| [line, "\n"]).collect();
    format!("{}\n{rest}", head.replace(&view_box, &cropped))
}

/// A length of the picture in SVG, to hundredths.
fn number(value: f64) -> String {
    crate::csv::number((100.0 * value).round() / 100.0)
}

/// The place of the 3D view, with its controls.
pub(super) fn view(scene: &SceneData) -> String {
    let labels = scene.description["labels"].as_array().map_or(0, Vec::len);
    let names: Vec<&str> = (scene.description["bodies"].as_array().into_iter().flatten())
        .filter_map(|body| body["name"].as_str())
        .take(12)
        .collect();
    let text = format!("Three-dimensional view of {}", names.join(", "));
    let steps = match labels {
        0 | 1 => String::new(),
        n => format!(
            "<button type=\"button\" id=\"play\" aria-pressed=\"false\">Play the load</button>\n\
             <label class=\"steps\">Load step <input type=\"range\" id=\"step\" min=\"0\" max=\"{}\" step=\"any\" value=\"0\"></label>\n\
             <output id=\"step-label\" for=\"step\"></output>\n",
            n - 1
        ),
    };
    format!(
        "<p class=\"how\">Drag to turn, scroll or pinch to come nearer; with the keyboard, the arrow keys turn, + and \u{2212} zoom, 0 goes back. Heights are \
         drawn to scale.</p>\n\
         <div class=\"view\" hidden>\n<canvas id=\"scene\" tabindex=\"0\" role=\"img\" aria-label=\"{}\"></canvas>\n<img id=\"scene-print\" alt=\"\" hidden>\n\
         <div class=\"controls\">\n{steps}<button type=\"button\" id=\"home\">First view</button>\n</div>\n\
         <fieldset id=\"bodies\"><legend>Shown</legend></fieldset>\n<p class=\"note\" id=\"view-notes\" hidden></p>\n</div>\n\
         <p class=\"note\" id=\"no-view\">The 3D view needs JavaScript with WebGL. scene.glb holds the same for any glTF viewer.</p>\n",
        escape(&text)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_title_of_a_picture_is_left_out_with_its_room() {
        let svg = "<svg viewBox=\"0 0 800 366.94\" width=\"800\" height=\"366.94\" fill=\"#222\">\n<rect/>\n\
                   <text font-weight=\"bold\">Title</text>\n<path/>\n</svg>\n";
        assert_eq!(
            untitled(svg),
            "<svg viewBox=\"0 24.3 800 342.64\" fill=\"#222\">\n<rect/>\n<path/>\n</svg>\n"
        );
    }
}
