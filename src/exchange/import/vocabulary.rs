//! The elements and attributes that a file may have (OpenSCENARIO XML 1.0 to 1.3): what is misspelt, or of a later version, is
//! refused and not passed over.
//!
//! Only elements that are read have a row. Nothing within others is looked at. They are refused as a whole where they
//! matter (an action that is not read), or say nothing of what is taken over (`Performance`, `License`).

use std::collections::{BTreeMap, BTreeSet};

use roxmltree::Node;

use super::source::children;

/// One child of any name: its reader refuses what it does not read.
const ONE: &str = "?";
/// Children of any name, for the same reason.
const ANY: &str = "*";

/// Each element with its attributes in brackets, and its children. `~`: the attribute may change what the file means and is not read,
/// so that a note says it where it stands. `-`: nothing that is taken over depends on it. docs/reference/formats.md is the same table.
const ELEMENTS: &str = "
    OpenSCENARIO [] FileHeader ParameterDeclarations VariableDeclarations MonitorDeclarations CatalogLocations
        RoadNetwork Entities Storyboard ParameterValueDistribution;
    FileHeader [author date- description revMajor revMinor] License Properties;
    ParameterDeclarations [] ParameterDeclaration;
    ParameterDeclaration [name parameterType value] ConstraintGroup;
    ConstraintGroup [] ValueConstraint;
    ValueConstraint [rule value];
    VariableDeclarations [] VariableDeclaration;
    VariableDeclaration [name variableType- value];
    CatalogLocations [] ControllerCatalog EnvironmentCatalog ManeuverCatalog MiscObjectCatalog
        PedestrianCatalog RouteCatalog TrajectoryCatalog VehicleCatalog;
    ControllerCatalog [] Directory;
    EnvironmentCatalog [] Directory;
    ManeuverCatalog [] Directory;
    MiscObjectCatalog [] Directory;
    PedestrianCatalog [] Directory;
    RouteCatalog [] Directory;
    TrajectoryCatalog [] Directory;
    VehicleCatalog [] Directory;
    Directory [path];
    RoadNetwork [] LogicFile SceneGraphFile TrafficSignals UsedArea;
    LogicFile [filepath];
    Entities [] *;
    ScenarioObject [name] CatalogReference Vehicle Pedestrian MiscObject ExternalObjectReference
        ObjectController;
    CatalogReference [catalogName entryName] ParameterAssignments;
    ParameterAssignments [] ParameterAssignment;
    ParameterAssignment [parameterRef value];
    Vehicle [name- vehicleCategory mass- model3d- role-] ParameterDeclarations BoundingBox Performance Axles
        Properties Trailer TrailerCoupler TrailerHitch;
    Pedestrian [name- pedestrianCategory mass- model- model3d- role-] ParameterDeclarations BoundingBox Properties;
    MiscObject [name- miscObjectCategory- mass- model3d-] ParameterDeclarations BoundingBox Properties;
    Performance [maxSpeed maxAcceleration maxAccelerationRate~ maxDeceleration maxDecelerationRate~];
    BoundingBox [] Center Dimensions;
    Center [x y~ z-];
    Dimensions [height length width];
    Storyboard [] Init Story StopTrigger;
    Init [] Actions;
    Actions [] *;
    Private [entityRef] PrivateAction;
    PrivateAction [] ?;
    TeleportAction [] Position;
    Position [] ?;
    LanePosition [roadId laneId s offset] Orientation;
    RelativeLanePosition [entityRef dLane ds dsLane offset] Orientation;
    RoadPosition [roadId s t] Orientation;
    RelativeRoadPosition [entityRef ds dt] Orientation;
    WorldPosition [x y z- h p~ r~];
    RelativeWorldPosition [entityRef dx dy dz-] Orientation;
    RelativeObjectPosition [entityRef dx dy dz-] Orientation;
    RoutePosition [] RouteRef InRoutePosition Orientation;
    RouteRef [] Route CatalogReference;
    InRoutePosition [] ?;
    FromCurrentEntity [entityRef];
    FromRoadCoordinates [pathS t];
    FromLaneCoordinates [pathS laneId laneOffset];
    PositionInRoadCoordinates [pathS t];
    PositionInLaneCoordinates [pathS laneId laneOffset];
    TrajectoryPosition [s t] Orientation TrajectoryRef;
    Orientation [h p r type];
    LongitudinalAction [] ?;
    SpeedAction [] SpeedActionDynamics SpeedActionTarget;
    SpeedActionDynamics [dynamicsShape dynamicsDimension value followingMode];
    SpeedActionTarget [] AbsoluteTargetSpeed RelativeTargetSpeed;
    AbsoluteTargetSpeed [value];
    SpeedProfileAction [entityRef followingMode] DynamicConstraints SpeedProfileEntry;
    DynamicConstraints [maxAcceleration maxAccelerationRate maxDeceleration maxDecelerationRate maxSpeed];
    SpeedProfileEntry [speed time];
    RelativeTargetSpeed [entityRef value speedTargetValueType continuous];
    LongitudinalDistanceAction [entityRef distance timeGap freespace continuous displacement coordinateSystem]
        DynamicConstraints;
    LateralAction [] ?;
    LaneChangeAction [targetLaneOffset] LaneChangeActionDynamics LaneChangeTarget;
    LaneChangeActionDynamics [dynamicsShape dynamicsDimension value followingMode];
    LaneChangeTarget [] AbsoluteTargetLane RelativeTargetLane;
    AbsoluteTargetLane [value];
    RelativeTargetLane [entityRef value];
    LaneOffsetAction [continuous] LaneOffsetActionDynamics LaneOffsetTarget;
    LaneOffsetActionDynamics [dynamicsShape maxLateralAcc];
    LaneOffsetTarget [] AbsoluteTargetLaneOffset RelativeTargetLaneOffset;
    AbsoluteTargetLaneOffset [value];
    RelativeTargetLaneOffset [entityRef value];
    SynchronizeAction [masterEntityRef targetTolerance~ targetToleranceMaster~] TargetPositionMaster
        TargetPosition FinalSpeed;
    TargetPositionMaster [] ?;
    TargetPosition [] ?;
    FinalSpeed [] ?;
    AbsoluteSpeed [value] TargetDistanceSteadyState TargetTimeSteadyState;
    RelativeSpeedToMaster [value speedTargetValueType] TargetDistanceSteadyState TargetTimeSteadyState;
    TargetDistanceSteadyState [distance];
    TargetTimeSteadyState [time];
    RoutingAction [] ?;
    FollowTrajectoryAction [initialDistanceOffset] Trajectory TrajectoryRef CatalogReference TimeReference
        TrajectoryFollowingMode;
    TrajectoryRef [] Trajectory CatalogReference;
    Trajectory [name- closed] ParameterDeclarations Shape;
    Shape [] ?;
    Polyline [] Vertex;
    Vertex [time] Position;
    Clothoid [curvature curvatureDot curvaturePrime length startTime stopTime] Position;
    ClothoidSpline [timeEnd] ClothoidSplineSegment;
    ClothoidSplineSegment [curvatureStart curvatureEnd length hOffset timeStart] PositionStart;
    PositionStart [] ?;
    Nurbs [order] ControlPoint Knot;
    ControlPoint [time weight] Position;
    Knot [value];
    TimeReference [] None Timing;
    Timing [domainAbsoluteRelative offset scale];
    TrajectoryFollowingMode [followingMode];
    AssignRouteAction [] Route CatalogReference;
    Route [name- closed] ParameterDeclarations Waypoint;
    Waypoint [routeStrategy] Position;
    AcquirePositionAction [] Position;
    VisibilityAction [graphics sensors traffic] SensorReferenceSet;
    ControllerAction [] ActivateControllerAction AssignControllerAction OverrideControllerValueAction;
    ActivateControllerAction [controllerRef- objectControllerRef- longitudinal lateral animation- lighting-];
    GlobalAction [] ?;
    EntityAction [entityRef] AddEntityAction DeleteEntityAction;
    VariableAction [variableRef] SetAction ModifyAction;
    EnvironmentAction [] Environment CatalogReference;
    Environment [name-] ParameterDeclarations TimeOfDay Weather RoadCondition;
    TimeOfDay [animation dateTime];
    Weather [atmosphericPressure- cloudState fractionalCloudCover temperature-] Sun Fog Precipitation Wind
        DomeImage;
    Sun [azimuth- elevation- illuminance intensity-];
    Precipitation [intensity precipitationIntensity precipitationType];
    Fog [visualRange] BoundingBox;
    RoadCondition [frictionScaleFactor wetness] Properties;
    Story [name-] ParameterDeclarations Act;
    Act [name] ManeuverGroup StartTrigger StopTrigger;
    ManeuverGroup [name maximumExecutionCount] Actors CatalogReference Maneuver;
    Actors [selectTriggeringEntities] EntityRef;
    EntityRef [entityRef];
    Maneuver [name] ParameterDeclarations Event;
    Event [name priority maximumExecutionCount] Action StartTrigger;
    Action [name] ?;
    StartTrigger [] ConditionGroup;
    StopTrigger [] ConditionGroup;
    ConditionGroup [] Condition;
    Condition [name- delay conditionEdge] ByEntityCondition ByValueCondition;
    ByValueCondition [] ?;
    SimulationTimeCondition [value rule];
    StoryboardElementStateCondition [storyboardElementType storyboardElementRef state];
    ParameterCondition [parameterRef value rule];
    VariableCondition [variableRef value rule];
    ByEntityCondition [] TriggeringEntities EntityCondition;
    TriggeringEntities [triggeringEntitiesRule] EntityRef;
    EntityCondition [] ?;
    TimeHeadwayCondition [entityRef value freespace rule alongRoute coordinateSystem relativeDistanceType
        routingAlgorithm];
    RelativeDistanceCondition [entityRef value freespace rule relativeDistanceType coordinateSystem
        routingAlgorithm];
    RelativeClearanceCondition [distanceForward distanceBackward freeSpace oppositeLanes] RelativeLaneRange EntityRef;
    RelativeLaneRange [from to];
    TimeToCollisionCondition [value freespace rule alongRoute coordinateSystem relativeDistanceType
        routingAlgorithm] TimeToCollisionConditionTarget;
    TimeToCollisionConditionTarget [] EntityRef Position;
    ReachPositionCondition [tolerance] Position;
    DistanceCondition [value freespace rule alongRoute coordinateSystem relativeDistanceType routingAlgorithm]
        Position;
    TraveledDistanceCondition [value];
    StandStillCondition [duration];
    CollisionCondition [] EntityRef ByType;
    ByType [objectType- type-];
    SpeedCondition [value rule direction];
    RelativeSpeedCondition [entityRef value rule direction];
    ParameterValueDistribution [] ScenarioFile Deterministic Stochastic;
    ScenarioFile [filepath];
    Stochastic [numberOfTestRuns randomSeed] StochasticDistribution;
    StochasticDistribution [parameterName] ?;
    ProbabilityDistributionSet [] Element;
    UniformDistribution [] Range;
    NormalDistribution [expectedValue variance] Range;
    PoissonDistribution [expectedValue] Range;
    Histogram [] Bin;
    Bin [weight] Range;
    Deterministic [] *;
    DeterministicSingleParameterDistribution [parameterName] ?;
    DeterministicMultiParameterDistribution [] ValueSetDistribution;
    DistributionSet [] Element;
    Element [value weight];
    DistributionRange [stepWidth] Range;
    Range [lowerLimit upperLimit];
    ValueSetDistribution [] ParameterValueSet;
    ParameterValueSet [] ParameterAssignment;
";

/// The attributes and the children of each element.
fn rows() -> BTreeMap<&'static str, (&'static str, &'static str)> {
    let row = |row: &'static str| {
        let (name, rest) = row.split_once('[')?;
        let (attributes, children) = rest.split_once(']')?;
        Some((name.trim(), (attributes, children.trim())))
    };
    ELEMENTS.split(';').filter_map(row).collect()
}

/// The findings about an element and all within it.
pub struct Found<'a, 'input> {
    /// Every element and attribute that no version has where it stands, with what is wrong.
    pub unknown: Vec<(Node<'a, 'input>, String)>,
    /// The unread content that may change what the file means.
    pub noted: BTreeSet<String>,
}

/// Looks at an element and all within it.
pub fn looked_over<'a, 'input>(root: Node<'a, 'input>) -> Found<'a, 'input> {
    let (rows, mut unknown, mut noted) = (rows(), Vec::new(), BTreeSet::new());
    let mut waiting = vec![root];
    while let Some(node) = waiting.pop() {
        let name = node.tag_name().name();
        let Some((attributes, known)) = rows.get(name) else { continue };
        // Attributes of a namespace belong to the schema (`xsi:noNamespaceSchemaLocation`).
        for attribute in node.attributes().filter(|attribute| attribute.namespace().is_none()) {
            let own = attribute.name();
            let mut named = attributes.split_whitespace().filter_map(|known| known.strip_prefix(own));
            match named.find(|mark| matches!(*mark, "" | "-" | "~")) {
                Some("~") if says_something(attribute.value()) => {
                    noted.insert(format!("`{own}` of `{name}` is not taken over"));
                }
                Some(_) => {}
                None => unknown.push((node, format!("it has no attribute `{own}`"))),
            }
        }
        if *known == ONE {
            match (children(node).next(), children(node).nth(1)) {
                (None, _) => unknown.push((node, "it is empty".to_owned())),
                (_, Some(second)) => unknown.push((second, format!("`{name}` holds one element"))),
                (Some(_), None) => {}
            }
        }
        for child in children(node) {
            let child_name = child.tag_name().name();
            if [ONE, ANY].contains(known) || known.split_whitespace().any(|known| known == child_name) {
                waiting.push(child);
            } else {
                unknown.push((child, format!("`{name}` has no such element")));
            }
        }
    }
    Found { unknown, noted }
}

/// Whether a value is another one than what holds without it.
fn says_something(value: &str) -> bool {
    let value = value.trim();
    !(matches!(value, "" | "false") || value.parse::<f64>().is_ok_and(|number| number == 0.0))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    /// Elements that stand where any element may.
    const CHOSEN: &str = "ScenarioObject Private GlobalAction TeleportAction LongitudinalAction LateralAction \
        RoutingAction VisibilityAction ControllerAction ActivateControllerAction SpeedAction SpeedProfileAction \
        LongitudinalDistanceAction LaneChangeAction FollowTrajectoryAction AssignRouteAction \
        AcquirePositionAction EnvironmentAction LanePosition RelativeLanePosition WorldPosition \
        Polyline PrivateAction SimulationTimeCondition StoryboardElementStateCondition \
        TimeHeadwayCondition RelativeDistanceCondition RelativeClearanceCondition TimeToCollisionCondition CollisionCondition ReachPositionCondition \
        RoadPosition RelativeRoadPosition RelativeWorldPosition RelativeObjectPosition RoutePosition \
        TrajectoryPosition FromCurrentEntity FromRoadCoordinates FromLaneCoordinates \
        PositionInRoadCoordinates PositionInLaneCoordinates LaneOffsetAction SynchronizeAction \
        AbsoluteSpeed RelativeSpeedToMaster Clothoid ClothoidSpline Nurbs EntityAction VariableAction \
        ParameterCondition VariableCondition DistanceCondition TraveledDistanceCondition \
        StandStillCondition SpeedCondition RelativeSpeedCondition \
        DeterministicSingleParameterDistribution DeterministicMultiParameterDistribution \
        DistributionSet DistributionRange ProbabilityDistributionSet UniformDistribution NormalDistribution \
        PoissonDistribution Histogram";

    #[test]
    fn every_row_is_reached_from_the_root() {
        let chosen: BTreeSet<&str> = CHOSEN.split_whitespace().collect();
        let rows = rows();
        let mut waiting = vec!["OpenSCENARIO"];
        let mut reached = BTreeSet::new();
        while let Some(name) = waiting.pop() {
            let Some((_, known)) = rows.get(name) else { continue };
            if reached.insert(name) {
                match [ONE, ANY].contains(known) {
                    true => waiting.extend(&chosen),
                    false => waiting.extend(known.split_whitespace()),
                }
            }
        }
        let missed: Vec<&str> = rows.keys().copied().filter(|name| !reached.contains(name)).collect();
        assert_eq!(missed, [""; 0]);
        assert!(chosen.iter().all(|name| reached.contains(name)), "each that is chosen has a row");
    }
}
