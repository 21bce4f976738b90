//! Checks the end of the layer and its boundary condition, for finite elements in plane strain and in three
//! dimensions.

use super::super::diagnostics::Diagnostic;
use super::super::model::LayerEnd;
use super::super::quantities::Size;
use super::super::raw::{self, Document};
use super::super::reader::{Log, Read};
use super::given;
use crate::material;

/// The boundary condition at the end of the layer.
pub(super) fn end(raw: &raw::LayerEnd) -> LayerEnd {
    match raw {
        raw::LayerEnd::Free => LayerEnd::Free,
        raw::LayerEnd::FreeOnSubstrate => LayerEnd::FreeOnSubstrate,
        raw::LayerEnd::Far => LayerEnd::Far,
    }
}

/// The layer's half-length, which `who` requires.
pub(super) fn half_length<'a>(
    document: &'a Document,
    who: &str,
    log: &mut Log<'_>,
) -> Option<&'a Read<Size>> {
    let layer = given(&document.layer)?;
    if layer.half_length.is_none() {
        let span = document.layer.as_ref().map_or(0..0, |read| read.span.clone());
        log.push(
            Diagnostic::at(&span, format!("[layer] lacks `half_length`, which {who} needs"))
                .label("a key is missing here")
                .help("add for example `half_length = \"4 mm\"`: from the middle of the layer to its end"),
        );
    }
    layer.half_length.as_ref()
}

/// Checks that a layer that is held at its end and pressed over its whole top is compressible, since its
/// volume must shrink. `way_out` begins the help with the boundary that could be opened.
pub(super) fn check_outlet<T>(
    end: &Read<raw::LayerEnd>,
    indenter: &Read<T>,
    document: &Document,
    way_out: &str,
    log: &mut Log<'_>,
) {
    let Some(read) = given(&document.layer).and_then(|layer| layer.material.as_ref()) else { return };
    let Some(material) = read.get() else { return };
    if !material::keeps_volume(material) {
        return;
    }
    log.push(
        Diagnostic::at(
            &end.span,
            "an incompressible layer that is held at its end cannot be pressed over its whole top",
        )
        .label("nothing can get out here, and the volume cannot change: no load has a solution")
        .related(&indenter.span, "this presses all of the top")
        .related(&read.span, "no `bulk_modulus`: incompressible")
        .help(format!(
            "{way_out} `\"free\"` or `\"free-on-substrate\"`, press with an indenter, or give the material a `bulk_modulus`"
        )),
    );
}
