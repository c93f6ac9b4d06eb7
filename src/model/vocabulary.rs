//! The engine's own words: what a `spawn`, a `set time` or a `set sky` in a space may mean.
//!
//! Enums are the author's; the names of their variants must be found here wherever a value reaches
//! the world. The tables are the one place that ties a spelling to a meaning.

/// A word of the engine: it has a spelling, and the spelling finds it again.
pub trait Word: Copy + PartialEq + 'static {
    /// Every word of this kind, in the order in which they are listed to authors.
    const ALL: &'static [Self];

    fn name(self) -> &'static str;

    fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|word| word.name() == name)
    }
}

/// Declares an enum whose variants are spelt as they are named.
macro_rules! words {
    ($(#[$doc:meta])* $kind:ident: $($(#[$variant_doc:meta])* $word:ident),+ $(,)?) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
        pub enum $kind { $($(#[$variant_doc])* $word),+ }

        impl Word for $kind {
            const ALL: &'static [$kind] = &[$($kind::$word),+];

            fn name(self) -> &'static str {
                match self { $($kind::$word => stringify!($word)),+ }
            }
        }
    };
}

words! {
    /// Period of the day: 10:00, 14:00 and 20:00 in the published package.
    TimeOfDay: Morning, Noon, Night
}

words! {
    /// What the sky does to the road.
    Phenomenon: Rain, Fog, Wetness
}

words! {
    /// How strongly: 0, 0.2, 0.5 and 1 on LGSVL's scale.
    Level: None, Light, Moderate, High
}

words! {
    /// Body of a road user.
    Body: Jeep, Sedan, SUV, Hatchback, BoxTruck, SchoolBus, Pedestrian
}

words! {
    /// Paint. It matters to nothing but the picture, yet belongs to the scenario.
    Colour: Pink, Red, Yellow, Black, White, Skyblue
}

words! {
    /// What a spawned road user does.
    Verb:
    /// Drives ahead of the ego vehicle in the same direction.
    DriveAhead,
    /// Comes from behind, faster, and passes.
    Overtake,
    /// Comes towards the ego vehicle in an opposing lane.
    DriveOpposite,
    /// Crosses the ego vehicle's way at a junction.
    CrossRoad,
    /// A pedestrian who crosses the road on foot.
    Walk,
    /// A pedestrian who stands in the lane.
    Stand,
}

words! {
    /// Lane of a spawn, seen from the ego vehicle's lane.
    LaneChoice: Left, Current, Right
}

words! {
    /// Side from which a crossing road user comes, seen from the ego vehicle.
    Side: Left, Right
}

words! {
    /// Whether a vehicle keeps its lane or changes it: the paper's "lane-change" group.
    Then: Keep, Change
}

impl Level {
    /// LGSVL's scale, in `[0, 1]`.
    pub fn intensity(self) -> f64 {
        match self {
            Level::None => 0.0,
            Level::Light => 0.2,
            Level::Moderate => 0.5,
            Level::High => 1.0,
        }
    }
}

impl Body {
    /// Everything on wheels.
    pub fn is_vehicle(self) -> bool {
        self != Body::Pedestrian
    }
}
