// The colours of avastra's files, written by `avastra editor-files`.
hljs.registerLanguage("ava", (hljs) => ({
  keywords: {"$pattern":"[A-Za-z_][A-Za-z0-9_.]*","built_in":"Animal Bicycle Black BoxTruck Brakes BusLanes Change CrossRoad Current DriveAhead DriveBehind DriveOpposite Ego Follow Hatchback Headlights Jeep Keep Left Motorcycle Object Others Overtake Pedestrian Pink Red Right RightOfWay SUV SchoolBus Sedan Signals Skyblue Stand Walk WalkAhead WalkOpposite White Yellow abs ago arrived avoidable begins change collision count elapsed hit max mean min near priority proc recently repeated road_users rule_breakers safety_gap since some spawn_gap stalled step struck sudden throughout times total","keyword":"language use enum odds state let fn action group optional rule require body manoeuvre trajectory road episode reward verdict expect scenario policy override digest without each any where set spawn as of apart order also step ahead behind from on with at by during once if for repeat within after origin start steps net claims rules when unless until lane match and or not implies in","literal":"true false","type":"Bool Int Length Duration Speed Accel Jerk Angle Mass Ratio RoadUser"},
  contains: [hljs.C_LINE_COMMENT_MODE, hljs.QUOTE_STRING_MODE, hljs.C_NUMBER_MODE],
}));
document.querySelectorAll("code.language-ava").forEach((block) => {
  block.textContent = block.textContent;
  hljs.highlightBlock(block);
});
