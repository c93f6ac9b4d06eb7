//! Reading OpenDRIVE (ASAM, 1.4 to 1.8): an XML text becomes typed elements that know their line.
//!
//! Left out on purpose: banks and crossfalls (with a warning where a road is not level), surfaces, railroads
//! and everything that does not say where a vehicle may drive or must stop, or where people may walk.

mod cubic;
mod cut;
mod elements;
mod geometry;
mod read;
mod vocabulary;
mod xml;

pub use elements::{
    Across, Contact, ControllerElement, Document, JunctionElement, LaneElement, Limit, MarkRule, Meaning,
    ObjectElement, ObjectKind, Orientation, Outline, RoadElement, RoadLink, SectionElement, SignalElement,
};
pub use read::{read, well_formed, xml_text};
pub use xml::{Lines, wrong};
