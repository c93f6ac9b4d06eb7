//! Why a vehicle has priority: the rule, the moment, and whose motion decided.

use avastra_lang::model::vocabulary::Priority;

/// The rules by which priority is decided. Articles are those of the Vienna Convention on Road Traffic (1968). In the
/// texts, "of the signs" means the Convention on Road Signs and Signals of the same year.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Rule {
    /// Neither came into the other's way by any of these rules.
    #[default]
    None,
    Siren,
    Light,
    BothLights,
    StopSign,
    FirstToStop,
    Sign,
    Turning,
    TurningOff,
    FromTheRight,
    SameSide,
    Clearing,
    Backing,
    Entering,
    TurningRound,
    LeavingLane,
    BothLeaveLanes,
    Middle,
    BothBeyondMiddle,
    Distance,
    Overtaking,
    Standing,
    Wreck,
    Crosswalk,
    SteppingOut,
    OnFoot,
}

impl Rule {
    /// The rule in a word, as it stands in tables.
    pub fn name(self) -> &'static str {
        self.row().0
    }

    /// Whether it is about two that came to a junction side by side: at their coming, where one turns off.
    pub fn is_beside_into_junction(self) -> bool {
        matches!(self, Rule::TurningOff | Rule::Overtaking)
    }

    /// The rule in a word, and in a sentence with its article.
    fn row(self) -> (&'static str, &'static str) {
        match self {
            Rule::None => ("none", "no rule of the road tells them apart"),
            Rule::Siren => ("siren", "an emergency vehicle under way goes first (article 34)"),
            Rule::Light => (
                "light",
                "a vehicle that passes a red light, or yellow though it could stop, gives way (article 23 of the signs)",
            ),
            Rule::BothLights => ("both_lights", "both passed a red light (article 23 of the signs)"),
            Rule::StopSign => (
                "stop_sign",
                "a vehicle that passes its stop sign without standing gives way (article 10 of the signs)",
            ),
            Rule::FirstToStop => {
                ("first_to_stop", "of two that stop at signs, the one that stood first goes first")
            }
            Rule::Sign => ("sign", "signs say which road gives way (article 18)"),
            Rule::Turning => {
                ("turning", "a vehicle that turns across the road gives way to oncoming traffic (article 16)")
            }
            Rule::TurningOff => (
                "turning_off",
                "a vehicle that turns off gives way to one that goes straight on beside it (article 16)",
            ),
            Rule::FromTheRight => {
                ("from_the_right", "the vehicle that comes from the right goes first (article 18)")
            }
            Rule::SameSide => ("same_side", "of two from one side, the one that turns less goes first"),
            Rule::Clearing => {
                ("clearing", "a vehicle that entered in good time may clear the junction (article 18)")
            }
            Rule::Backing => ("backing", "a vehicle that backs up gives way (article 14)"),
            Rule::Entering => {
                ("entering", "a vehicle that comes from beside the road gives way (articles 14 and 18)")
            }
            Rule::TurningRound => {
                ("turning_round", "a vehicle that turns round or crosses the lanes gives way (article 14)")
            }
            Rule::LeavingLane => {
                ("leaving_lane", "a vehicle that leaves its lane gives way (articles 11 and 14)")
            }
            Rule::BothLeaveLanes => ("both_leave_lanes", "both leave their lanes (article 14)"),
            Rule::Middle => {
                ("middle", "a vehicle beyond the middle of the road gives way (articles 10 and 12)")
            }
            Rule::BothBeyondMiddle => {
                ("both_beyond_middle", "both are beyond the middle of the road (articles 10 and 12)")
            }
            Rule::Distance => ("distance", "a vehicle behind another keeps its distance (article 13)"),
            Rule::Overtaking => ("overtaking", "a vehicle that passes another leaves room (article 11)"),
            Rule::Standing => ("standing", "a driver stops for a vehicle that stands in sight (article 13)"),
            Rule::Wreck => ("wreck", "a driver stops for a wreck in sight (article 13)"),
            Rule::Crosswalk => ("crosswalk", "a pedestrian on a crosswalk goes first (article 21)"),
            Rule::SteppingOut => ("stepping_out", "a pedestrian does not step out too near (article 20)"),
            Rule::OnFoot => (
                "on_foot",
                "a pedestrian crosses with regard, a driver stops for one in sight (articles 13, 20 and 21)",
            ),
        }
    }
}

/// Whose motion decided: the ego vehicle, the other or both came into the other's way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Mover {
    Ego,
    Other,
    #[default]
    Both,
}

impl Mover {
    pub fn name(self) -> &'static str {
        match self {
            Mover::Ego => "ego",
            Mover::Other => "other",
            Mover::Both => "both",
        }
    }
}

/// The priority, and its reason.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Ruling {
    pub priority: Priority,
    pub rule: Rule,
    pub mover: Mover,
    /// When the first of the two came into the other's way, s since the episode began.
    pub time_s: f64,
}

impl Ruling {
    /// Whether the ego vehicle was where it was not allowed to be, whoever else was.
    pub fn is_ego_wrong(&self) -> bool {
        let both = match self.rule {
            Rule::BothLights | Rule::BothLeaveLanes | Rule::BothBeyondMiddle => true,
            Rule::StopSign => self.priority == Priority::None,
            _ => false,
        };
        both || self.priority == Priority::Other
    }

    /// Why, in a sentence without a full stop.
    fn reason(&self) -> &'static str {
        match (self.rule, self.priority) {
            (Rule::Clearing, Priority::None) => {
                "the other had passed its light or sign, and a driver stops for a vehicle that it sees in the junction (articles 13 and 18)"
            }
            (Rule::Wreck, Priority::None) => "a wreck came into the way too late to stop for it (article 13)",
            (rule, _) => rule.row().1,
        }
    }

    /// The priority and its reason, in a sentence without a full stop: `the other had priority: …`.
    pub fn describe(&self) -> String {
        let who = match self.priority {
            Priority::Ego => "the ego vehicle had priority",
            Priority::Other => "the other had priority",
            Priority::None => "neither had priority",
        };
        let came = match self.mover {
            Mover::Ego => "the ego vehicle came into its way",
            Mover::Other => "it came into the ego vehicle's way",
            Mover::Both => "they met",
        };
        format!("{who}: {}; at {:.1} s {came}", self.reason(), self.time_s)
    }
}
