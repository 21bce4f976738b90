//! How a punch touches the layer, in plane strain as in three dimensions.

use super::super::model::PunchContact;
use super::super::raw;
use super::super::reader::Read;

/// How a punch touches the layer; `None` if the file says something else.
pub(super) fn contact(raw: &Option<Read<raw::Contact>>) -> Option<PunchContact> {
    Some(match raw {
        Some(read) => match read.get()? {
            raw::Contact::Smooth => PunchContact::Smooth,
            raw::Contact::Bonded => PunchContact::Bonded,
            raw::Contact::Held => PunchContact::Held,
        },
        None => PunchContact::Smooth,
    })
}
