" The syntax of avastra's files, written by `avastra editor-files`.
if exists("b:current_syntax")
  finish
endif
syntax iskeyword @,48-57,_,.
syntax keyword avaDeclaration language use enum odds state let fn action group optional rule require body manoeuvre trajectory road episode reward verdict expect scenario policy override
syntax keyword avaClause digest without each any where set spawn as of apart order also step ahead behind from on with at by during once if for repeat within after origin start steps net claims rules when unless until lane match
syntax keyword avaOperator and or not implies in
syntax keyword avaLiteral true false
syntax keyword avaType Bool Int Length Duration Speed Accel Jerk Angle Mass Ratio RoadUser
syntax keyword avaWord Animal Bicycle Black BoxTruck Brakes BusLanes Change CrossRoad Current DriveAhead DriveBehind DriveOpposite Ego Follow Hatchback Headlights Jeep Keep Left Motorcycle Object Others Overtake Pedestrian Pink Red Right RightOfWay SUV SchoolBus Sedan Signals Skyblue Stand Walk WalkAhead WalkOpposite White Yellow
syntax keyword avaFact abs ago arrived avoidable begins change collision count ego.acceleration ego.crosses ego.crosswalk_ahead ego.front ego.jerk ego.junction_ahead ego.junction_end ego.lane_offset ego.lane_width ego.lateral_acceleration ego.lead_gap ego.lead_since ego.lead_speed ego.light ego.light_left ego.light_since ego.limit ego.off_road ego.offset ego.over_crosswalk ego.over_lane ego.over_line ego.over_oncoming ego.over_red ego.over_stop ego.rear ego.road ego.route_left ego.speed ego.turn ego.visibility elapsed hit max mean min near nearest.gap nearest.speed npc.acceleration npc.across npc.along npc.aside npc.contact_in npc.crashed npc.crossing_ahead npc.crosswalk_gap npc.ego_crossing_ahead npc.front npc.gap npc.headway npc.in_lane npc.in_next_junction npc.junction_ahead npc.lane_left npc.lanes_left npc.leads npc.light npc.light_left npc.light_since npc.limit npc.next_crosswalk_gap npc.off_road npc.offset npc.pet npc.priority npc.rear npc.siren npc.speed npc.station npc.ttc npc.turn priority proc recently repeated road.limit road_users rule_breakers safety_gap since some spawn_gap stalled struck sudden throughout times total
syntax match avaNumber /\<\d\+\(\.\d\+\)\?\([eE][+-]\?\d\+\)\?/
syntax region avaString start=/"/ skip=/\\./ end=/"/ oneline
syntax match avaComment /\/\/.*$/
syntax match avaDoc /\/\/[\/!].*$/
highlight default link avaDeclaration Keyword
highlight default link avaClause Statement
highlight default link avaOperator Operator
highlight default link avaLiteral Boolean
highlight default link avaType Type
highlight default link avaWord Constant
highlight default link avaFact Identifier
highlight default link avaNumber Number
highlight default link avaString String
highlight default link avaComment Comment
highlight default link avaDoc SpecialComment
let b:current_syntax = "avastra"
