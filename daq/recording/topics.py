"""The channels of a capture: ROS 2 names and definitions, so that robotics tools open it as it is."""

from __future__ import annotations

from daq.recording.mcap_file import Topic

JOINT_STATE = "sensor_msgs/msg/JointState"
CYCLE_STATUS = "armhil/msg/CycleStatus"
CAN_FRAME = "can_msgs/msg/Frame"
LOG = "rcl_interfaces/msg/Log"
TEMPERATURE = "sensor_msgs/msg/Temperature"
JOINT_CHANNELS = "armhil/msg/JointChannels"
STRING = "std_msgs/msg/String"
TF = "tf2_msgs/msg/TFMessage"

REFERENCE_TOPIC = "/joint_reference"
MEASURED_TOPIC = "/joint_states"
STATUS_TOPIC = "/cycle_status"
FRAMES_TOPIC = "/can_frames"
EVENTS_TOPIC = "/drive_events"
TEMPERATURE_TOPIC = "/temperatures"
BESIDE_TOPIC = "/joint_channels"
DESCRIPTION_TOPIC = "/robot_description"
STATIC_TOPIC = "/tf_static"
TF_TOPIC = "/tf"

_SEPARATOR = "=" * 80
_TIME_DEFINITION = f"""\
{_SEPARATOR}
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
_HEADER_DEFINITION = f"""\
{_SEPARATOR}
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
{_TIME_DEFINITION}"""
JOINT_STATE_DEFINITION = f"""\
std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
{_HEADER_DEFINITION}"""
CYCLE_STATUS_DEFINITION = f"""\
# One SYNC of the bus. Arrays have one entry per drive, in the order of name.
std_msgs/Header header
# Number of the SYNC since the stream began; a missing number is a cycle that was not recorded.
uint64 cycle
# Time between the deadline of this SYNC and the moment it was sent, s.
float64 lateness
string[] name
# Control signal v_tau of the drive, in the units of the robot description.
float64[] control_signal
# CiA 402 statusword, object 6041.
uint16[] statusword
# Whether the drive answered this SYNC in time.
bool[] complete
# Reference minus position of the joint, rad or m.
float64[] following_error
{_HEADER_DEFINITION}"""
CAN_FRAME_DEFINITION = f"""\
# One frame as this machine received it; the stamp is the kernel's where it gives one.
std_msgs/Header header
uint32 id
bool is_rtr
bool is_extended
bool is_error
uint8 dlc
uint8[8] data
{_HEADER_DEFINITION}"""
LOG_DEFINITION = f"""\
byte DEBUG=10
byte INFO=20
byte WARN=30
byte ERROR=40
byte FATAL=50
builtin_interfaces/Time stamp
uint8 level
# Joint of the drive; bus where it is none.
string name
# In words.
string msg
# COB-ID of the frame that said so; empty where no frame did.
string file
# EMCY, state, NMT or bus.
string function
# Error code of an EMCY, else the state as the drive reports it.
uint32 line
{_TIME_DEFINITION}"""
TEMPERATURE_DEFINITION = f"""\
# frame_id is the joint.
std_msgs/Header header
# Degrees Celsius.
float64 temperature
# 0 is unknown.
float64 variance
{_HEADER_DEFINITION}"""
JOINT_CHANNELS_DEFINITION = f"""\
# What an imported log has beside positions and control signals. Arrays have one entry per joint, in the
# order of name; those that the log does not have are empty.
std_msgs/Header header
string[] name
# Position by second encoders at the links, rad or m.
float64[] second_position
# Torque on the joints by measured forces from outside, N*m or N.
float64[] torque_from_outside
# Part of the control signal that no controller asked for, in its units.
float64[] added_signal
# Degrees Celsius.
float64[] temperature
{_HEADER_DEFINITION}"""
STRING_DEFINITION = "string data\n"
TF_DEFINITION = f"""\
geometry_msgs/TransformStamped[] transforms
{_SEPARATOR}
MSG: geometry_msgs/TransformStamped
std_msgs/Header header
string child_frame_id
geometry_msgs/Transform transform
{_SEPARATOR}
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
{_SEPARATOR}
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
{_SEPARATOR}
MSG: geometry_msgs/Transform
geometry_msgs/Vector3 translation
geometry_msgs/Quaternion rotation
{_SEPARATOR}
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
{_SEPARATOR}
MSG: geometry_msgs/Quaternion
float64 x 0
float64 y 0
float64 z 0
float64 w 1
"""

TOPICS = (
    Topic(REFERENCE_TOPIC, JOINT_STATE, JOINT_STATE_DEFINITION),
    Topic(MEASURED_TOPIC, JOINT_STATE, JOINT_STATE_DEFINITION),
    Topic(STATUS_TOPIC, CYCLE_STATUS, CYCLE_STATUS_DEFINITION),
    Topic(FRAMES_TOPIC, CAN_FRAME, CAN_FRAME_DEFINITION),
    Topic(EVENTS_TOPIC, LOG, LOG_DEFINITION),
    Topic(TEMPERATURE_TOPIC, TEMPERATURE, TEMPERATURE_DEFINITION),
    Topic(BESIDE_TOPIC, JOINT_CHANNELS, JOINT_CHANNELS_DEFINITION),
    Topic(DESCRIPTION_TOPIC, STRING, STRING_DEFINITION),
    Topic(STATIC_TOPIC, TF, TF_DEFINITION),
    Topic(TF_TOPIC, TF, TF_DEFINITION),
)
# Channels are numbered in this order, so a reader knows them even where the chunk that introduces them is
# damaged.
CHANNELS = {number: topic.name for number, topic in enumerate(TOPICS, start=1)}
NUMBERS = {name: number for number, name in CHANNELS.items()}
