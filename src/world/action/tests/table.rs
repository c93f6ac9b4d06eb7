use super::table;

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
fn the_text_of_one_road_has_its_ranges() {
    let text = table("scenarios/avastra45.ava").text(Some("corner"));
    assert!(text.contains("speed 10.00..11.18 m/s"), "{text}");
}
