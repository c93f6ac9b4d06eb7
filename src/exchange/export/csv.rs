//! A recording as a table: one row for every road user at every tick.

use std::fmt::Write;

use avastra_lang::model::vocabulary::Word;
use avastra_world::sim::DT_S;

use super::recording::Recording;
use super::xml::number;

/// One line per road user and time, by rising time, then in order of appearance. Columns:
///
/// - `time_s`; `id`: 0 is the ego vehicle, others as claims number them; `body`.
/// - `x_m`, `y_m`: the middle of the outline in the plane of the map; `heading_rad`.
/// - `vx_mps`, `vy_mps` in the same plane.
/// - `length_m`, `width_m`, `height_m`.
/// - `contact`: 1 at the end of the tick in which it began to touch another road user or the ego vehicle.
/// - `like`: the body of the engine that `body` is, or that a body of the author's is like.
/// - `name`: its name, if it has one.
/// - `along_m`, `left_m`: its middle along the ego vehicle's route, and to the left of the route.
/// - `lights` that a vehicle was told to show.
/// - `contact_with`: the numbers of those that it began to touch, with spaces between them.
pub fn csv(recording: &Recording) -> String {
    let mut text = "time_s,id,body,x_m,y_m,heading_rad,vx_mps,vy_mps,length_m,width_m,height_m,contact,like,\
         name,along_m,left_m,lights,contact_with\n"
        .to_owned();
    for tick in 0..=recording.seen.end_tick {
        for actor in recording.actors() {
            let Some(sample) =
                tick.checked_sub(actor.first_tick()).and_then(|index| actor.samples.get(index as usize))
            else {
                continue;
            };
            let (along_m, left_m) = recording.road.route.path.beside(sample.pose.position);
            let met: Vec<String> = recording.seen.met_by(actor.id, tick).iter().map(u32::to_string).collect();
            let like = if actor.id == 0 { "ego" } else { actor.body.name() };
            let _ = writeln!(
                text,
                "{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}",
                number(tick as f64 * DT_S),
                actor.id,
                recording.own_bodies.get(&actor.id).map_or(like, String::as_str),
                number(sample.pose.position.x),
                number(sample.pose.position.y),
                number(sample.pose.heading_rad),
                number(sample.velocity_mps.x),
                number(sample.velocity_mps.y),
                number(actor.shape.length_m),
                number(actor.shape.width_m),
                number(actor.shape.height_m),
                u8::from(!met.is_empty()),
                like,
                recording.names.get(&actor.id).map_or("", String::as_str),
                number(along_m),
                number(left_m),
                actor.lights_at(tick).name(),
                met.join(" "),
            );
        }
    }
    text
}
