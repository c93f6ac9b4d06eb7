//! The tables of the shipped spaces, compared with the published rows.

use std::sync::Arc;

use avastra::action::ActionTable;

use crate::cases::expect_snapshot;
use crate::world::space;

#[test]
fn tables_are_as_reviewed() {
    for name in ["avastra45", "deepcollision52"] {
        let table = ActionTable::new(space(&format!("{name}.ava")));
        expect_snapshot("tables", name, &table.text(None));
        expect_snapshot("tables", &format!("{name}_audit"), &avastra::action::audit(&table).to_string());
    }
}

/// Published ids of the rows of `avastra45.ava`, in the order of its table: the released package's
/// `api_service_list.json`, where a vehicle's flag `maintainlane=1` means that it changes its lane.
#[test]
fn each_row_is_one_of_the_published_45() {
    let vehicles = |verb: &str, axes: &[(&str, [u32; 2])]| -> Vec<(String, u32)> {
        axes.iter()
            .flat_map(|(axis, [keep, change])| {
                [
                    (format!("{verb}({axis}, then: Keep)"), *keep),
                    (format!("{verb}({axis}, then: Change)"), *change),
                ]
            })
            .collect()
    };
    let mut published: Vec<(String, u32)> = [
        ("clear_sky()", 0),
        ("rain(how: Light)", 1),
        ("rain(how: Moderate)", 2),
        ("rain(how: High)", 3),
        ("fog(how: Light)", 4),
        ("fog(how: Moderate)", 5),
        ("fog(how: High)", 6),
        ("wet(how: Light)", 7),
        ("wet(how: Moderate)", 8),
        ("wet(how: High)", 9),
        ("set_time(to: Morning)", 10),
        ("set_time(to: Noon)", 11),
        ("set_time(to: Night)", 12),
        ("pedestrian(from: Left)", 13),
        ("pedestrian(from: Right)", 14),
    ]
    .map(|(label, id)| (label.to_owned(), id))
    .to_vec();
    published.extend(vehicles(
        "drive_ahead",
        &[
            ("lane: Left, mode: Near", [25, 26]),
            ("lane: Left, mode: Far", [24, 23]),
            ("lane: Current, mode: Near", [17, 18]),
            ("lane: Current, mode: Far", [16, 15]),
            ("lane: Right, mode: Near", [22, 21]),
            ("lane: Right, mode: Far", [19, 20]),
        ],
    ));
    published.extend(vehicles(
        "overtake",
        &[
            ("lane: Left, mode: Near", [30, 29]),
            ("lane: Current, mode: Near", [32, 31]),
            ("lane: Right, mode: Near", [28, 27]),
        ],
    ));
    published.extend(vehicles("drive_opposite", &[("mode: Near", [35, 36]), ("mode: Far", [33, 34])]));
    published.extend(vehicles(
        "cross_road",
        &[
            ("side: Left, mode: Near", [44, 43]),
            ("side: Left, mode: Far", [42, 41]),
            ("side: Right, mode: Near", [40, 39]),
            ("side: Right, mode: Far", [38, 37]),
        ],
    ));
    let space: Arc<_> = space("avastra45.ava");
    let labels: Vec<&str> = space.rows.iter().map(|row| row.label.as_str()).collect();
    let expected: Vec<&str> = published.iter().map(|(label, _)| label.as_str()).collect();
    assert_eq!(labels, expected);
    let mut ids: Vec<u32> = published.iter().map(|(_, id)| *id).collect();
    ids.sort_unstable();
    assert_eq!(ids, (0..45).collect::<Vec<u32>>());
}
