//! Checks that attached bodies can move with the layer or the indenter.

use super::super::diagnostics::{Diagnostic, shown};
use super::super::model::Pose;
use super::super::raw::{self, Document};
use super::super::reader::{Log, Read};
use super::super::values::Text;
use super::given;
use super::layer_room::{is_metal, is_pressed_flat};

/// Refuses bodies that are attached to a layer that is missing, or to a top that does not stay flat. Refuses
/// `shift` and `tilt` where a body moves with the material of the layer, and where no body is attached at
/// all.
pub(super) fn check(raw: &Document, poses: &[Pose], log: &mut Log<'_>) {
    let conductors = given(&raw.conductor).into_iter().flatten().filter_map(Read::get);
    let dielectrics = given(&raw.dielectric).into_iter().flatten().filter_map(Read::get);
    let bodies = conductors.map(|c| (&c.name, &c.attached));
    let bodies = bodies.chain(dielectrics.map(|d| (&d.name, &d.attached)));
    let (mut any_on_top_or_indenter, mut any_in_layer) = (false, false);
    for (name, attached) in bodies {
        let Some(read) = attached else { continue };
        let (Some(Text(name)), Some(to)) = (name.get(), read.get()) else { continue };
        if matches!(to, raw::Attached::Fixed) {
            continue;
        }
        let moves_with_layer = matches!(to, raw::Attached::Layer);
        any_on_top_or_indenter |= !moves_with_layer;
        any_in_layer |= moves_with_layer;
        if raw.layer.is_none() {
            log.push(
                Diagnostic::at(
                    &read.span,
                    format!("\"{}\" is attached to a layer that is not there", shown(name)),
                )
                .label("there is no [layer]")
                .help("add a [layer], or leave `attached` out"),
            );
        } else if matches!(to, raw::Attached::LayerTop) && !is_pressed_flat(raw) {
            log.push(
                Diagnostic::at(
                    &read.span,
                    format!("\"{}\" cannot lie on top of a layer that an indenter bends", shown(name)),
                )
                .label("the top does not stay flat")
                .help(if is_metal(raw) {
                    "write `attached = \"indenter\"` for what moves with the indenter, apart from it, or press the whole top"
                } else {
                    "write `attached = \"layer\"` for a sheet on the top, `attached = \"indenter\"` for what moves with the indenter, or press \
                     the whole top"
                }),
            );
        }
    }
    let moves = poses.iter().any(|pose| pose.shift != [0.0; 2] || pose.tilt != [0.0; 2]);
    let steps = given(&raw.load).and_then(|load| load.steps.as_ref());
    if let (true, true, Some(load)) = (any_in_layer, moves, &raw.load) {
        log.push(
            Diagnostic::at(
                steps.map_or(&load.span, |read| &read.span),
                "`shift` and `tilt` are not known of bodies that move with the material of the layer",
            )
            .label("a body has `attached = \"layer\"`")
            .help("leave out `shift` and `tilt`, or lay the bodies on the faces of the layer"),
        );
    }
    if let (false, true, Some(load)) = (any_on_top_or_indenter, moves, &raw.load) {
        log.push(
            Diagnostic::at(
                steps.map_or(&load.span, |read| &read.span),
                "`shift` and `tilt` of the load steps move nothing",
            )
            .label("no body is attached to the layer or to the indenter")
            .help("add `attached = \"layer-top\"` to the body that moves"),
        );
    }
}
