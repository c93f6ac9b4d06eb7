use super::table;

#[test]
fn deepcollision52_has_its_rows_in_published_order() {
    let table = table("scenarios/deepcollision52.ava");
    assert_eq!(table.rows().len(), 52);
    let starts = |index: usize, label: &str| assert_eq!(table.rows()[index].label, label);
    starts(0, "pedestrian_from_right()");
    starts(14, "set_time(to: Night)");
    starts(15, "drive(vehicle: Sedan, then: Change, lane: Left)");
    starts(39, "drive(vehicle: SchoolBus, then: Change, lane: Left)");
    starts(51, "pedestrian_from_left()");
}

#[test]
fn the_file_survives_yaml() {
    let table = table("scenarios/avastra45.ava");
    let file = table.file();
    let text = serde_yaml::to_string(&file).unwrap();
    let back: crate::action::TableFile = serde_yaml::from_str(&text).unwrap();
    assert_eq!(back, file);
    let row = &file.rows[15];
    let speed = row.roads[0].draws.iter().find(|draw| draw.name == "speed").unwrap();
    assert_eq!(speed.low, Some(10.0));
    assert!(speed.high.unwrap() < 20.0, "the road's limit cuts the range");
}

#[test]
fn text_and_audit_name_every_row_and_rule() {
    let table = table("scenarios/avastra45.ava");
    assert_eq!(table.text(None).lines().count(), 45);
    assert!(table.text(Some("corner")).contains("speed 10.00..11.18 m/s"), "{}", table.text(Some("corner")));
    let audit = crate::action::audit(&table);
    assert_eq!(audit.rules.len(), table.space().rules.len());
    assert!(audit.rules.iter().all(|rule| !rule.rows.is_empty()), "{audit}");
}
