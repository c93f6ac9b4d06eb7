//! The attributes of OpenDRIVE 1.4 to 1.8, and what becomes of each: docs/reference/formats.md is the same table.

use std::collections::{BTreeMap, BTreeSet};

use roxmltree::Node;

/// Each element that is read, by its parent's name and its own, with its attributes. `~`: it may change what the file means and is
/// not read, so that a warning says it where it stands. `-`: nothing that is read depends on it. Elements without a row are not
/// read, nor is what lies within them.
const ELEMENTS: &str = "
    OpenDRIVE.header [date- east- name north- revMajor- revMinor- south- vendor- version- west-];
    OpenDRIVE.controller [id name- sequence-];
    controller.control [signalId type-];
    OpenDRIVE.junction [id mainRoad- name orientation- sEnd- sStart- type];
    junction.connection [connectingRoad connectionMaster- contactPoint id- incomingRoad linkedRoad type-];
    connection.laneLink [from overlapZone~ to];
    junction.controller [id sequence- type-];
    junction.priority [high low];
    OpenDRIVE.road [id junction length name- rule];
    road.link [];
    link.predecessor [contactPoint elementDir- elementId elementS elementType id];
    link.successor [contactPoint elementDir- elementId elementS elementType id];
    road.type [country- s type];
    type.speed [max unit];
    road.planView [];
    planView.geometry [hdg length s x y];
    geometry.line [];
    geometry.arc [curvature];
    geometry.spiral [curvEnd curvStart];
    geometry.poly3 [a b c d];
    geometry.paramPoly3 [aU aV bU bV cU cV dU dV pRange];
    road.elevationProfile [];
    elevationProfile.elevation [a b c d s];
    road.lateralProfile [];
    lateralProfile.crossfall [a b c d s- side-];
    lateralProfile.shape [a b c d s- t-];
    lateralProfile.superelevation [a b c d s-];
    road.lanes [];
    lanes.laneOffset [a b c d s];
    lanes.laneSection [s singleSide];
    laneSection.left [];
    laneSection.right [];
    left.lane [advisory~ direction dynamicLaneDirection~ dynamicLaneType~ id level- roadWorks~ type];
    right.lane [advisory~ direction dynamicLaneDirection~ dynamicLaneType~ id level- roadWorks~ type];
    lane.link [];
    lane.width [a b c d sOffset];
    lane.border [a b c d sOffset];
    lane.roadMark [color- height- laneChange material- sOffset type weight- width-];
    lane.speed [max sOffset unit];
    lane.access [restriction rule sOffset];
    access.restriction [type];
    lane.material [friction~ roughness- sOffset- surface-];
    road.objects [];
    objects.object [dynamic- hdg height- id length name- orientation- perpToRoad- pitch- radius- roll- s subtype- t type
        validLength- width zOffset];
    object.repeat [detachFromReferenceLine- distance heightEnd- heightStart- length lengthEnd- lengthStart- radiusEnd- radiusStart-
        s tEnd tStart widthEnd- widthStart zOffsetEnd- zOffsetStart-];
    object.outlines [];
    object.outline [closed- fillType- id- laneType- outer-];
    outlines.outline [closed- fillType- id- laneType- outer-];
    outline.cornerLocal [height- id- u v z-];
    outline.cornerRoad [dz- height- id- s t];
    road.signals [];
    signals.signal [country countryRevision- dynamic hOffset- height- id length- name orientation pitch- roll- s subtype t text-
        type unit- value- width- zOffset-];
    signal.validity [fromLane toLane];
    signals.signalReference [id orientation s t];
    signalReference.validity [fromLane toLane];
";

/// Elements that may change what a file means and are not read: a warning says it where one stands that says something.
const NOTED: &str = "
    *.include header.defaultRegulations junction.crossPath junction.elevationGrid lane.rule lateralProfile.crossSectionSurface
    objects.objectReference road.railroad signal.semantics signal.vmsBoard
";

/// Elements and attributes of a map that may change its meaning and are not read, in words, each as often as it occurs.
pub fn unread<'a>(root: Node<'a, '_>) -> impl Iterator<Item = String> + 'a {
    let mut attributes: BTreeMap<(&str, &str), Vec<&str>> = BTreeMap::new();
    for row in ELEMENTS.split(';') {
        let Some((element, rest)) = row.trim().split_once(" [") else { continue };
        let noted = rest.trim_end_matches(']').split_whitespace().filter_map(|name| name.strip_suffix('~'));
        let noted: Vec<&str> = noted.collect();
        let Some(key) = element.split_once('.').filter(|_| !noted.is_empty()) else { continue };
        attributes.insert(key, noted);
    }
    let elements: BTreeSet<(&str, &str)> =
        NOTED.split_whitespace().filter_map(|name| name.split_once('.')).collect();
    root.descendants().filter(Node::is_element).flat_map(move |node| {
        let name = node.tag_name().name();
        let parent = node.parent_element().map_or("", |parent| parent.tag_name().name());
        let is_unread = elements.contains(&(parent, name)) || elements.contains(&("*", name));
        let says = node.has_children() || node.attributes().len() > 0;
        let whole = (is_unread && says).then(|| format!("`{name}` of `{parent}`"));
        let noted = attributes.get(&(parent, name)).into_iter().flatten();
        let noted = noted.filter(|attribute| node.attribute(**attribute).is_some_and(says_something));
        let words = noted.map(|attribute| format!("`{attribute}` of `{name}`"));
        whole.into_iter().chain(words).collect::<Vec<String>>()
    })
}

/// Whether a value is another one than what holds without it.
fn says_something(value: &str) -> bool {
    let value = value.trim();
    !(matches!(value, "" | "false" | "no" | "none") || value.parse::<f64>().is_ok_and(|number| number == 0.0))
}
