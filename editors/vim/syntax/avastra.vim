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
syntax keyword avaFact abs ago arrived avoidable begins change collision count elapsed hit max mean min near priority proc recently repeated road_users rule_breakers safety_gap since some spawn_gap stalled step struck sudden throughout times total
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
