/* FluidNC's own interpreter, without a machine: what each line of a program does.

   Reads lines from standard input and prints one line of JSON for each:

       [line, error, motions, rapids, G91, inch, F, position, offset, position, offset, ...]

   F in mm/min; positions in machine coordinates and offsets of each axis in mm. Its own GCode.cpp takes
   the lines apart and executes them; what that would ask of a machine is here, and moves nothing. It is told that
   programs are checked ($C). Built by firmware.py with the sources of a checkout. */

#include <cstdio>
#include <cstring>

#include "Configuration/GCodeParam.h"
#include "GCode.h"
#include "Job.h"
#include "Jog.h"
#include "Machine/MachineConfig.h"
#include "Machine/UserInputs.h"
#include "Machine/UserOutputs.h"
#include "MotionControl.h"
#include "Protocol.h"
#include "Report.h"
#include "Serial.h"
#include "Settings.h"

/* Objects of which only the addresses, or members that are zero, count here. */
alignas(16) static char none[8][65536];
alignas(16) char channels[65536] asm("allChannels");
alignas(16) char digital_inputs[8192] asm("_ZN7Machine10UserInputs12digitalInputE");
alignas(16) char analog_inputs[8192] asm("_ZN7Machine10UserInputs11analogInputE");
char table_of_parameters[1024] asm("_ZTVN13Configuration10GCodeParamE");

static int motions, rapids;

bool mc_linear(float* target, plan_line_data_t* data, float* position) {
    motions++;
    rapids += data->motion.rapidMotion;
    return true;
}

void mc_arc(float*, plan_line_data_t*, float*, float*, float, axis_t, axis_t, axis_t, bool, uint32_t) {
    motions++;
}

GCUpdatePos mc_probe_cycle(float*, plan_line_data_t*, bool, bool, AxisMask, float) {
    motions++;
    return GCUpdatePos::Target;
}

bool mc_dwell(int32_t) { return false; }
void mc_override_ctrl_update(Override) {}

/* Where it stands: what its variables ask for. */
static float place[MAX_N_AXIS], offset[MAX_N_AXIS];

float* get_mpos() {
    memcpy(place, gc_state.position, sizeof place);
    return place;
}

float* get_wco() {
    for (int axis = 0; axis < MAX_N_AXIS; axis++)
        offset[axis] = gc_state.coord_system[axis] + gc_state.coord_offset[axis] + gc_state.tool_length_offset[axis];
    return offset;
}

void mpos_to_wpos(float* position) {
    float* from = get_wco();
    for (int axis = 0; axis < MAX_N_AXIS; axis++)
        position[axis] -= from[axis];
}

system_t sys;
steps_t steps[MAX_N_AXIS], probe_steps[MAX_N_AXIS];
bool probe_succeeded;
steps_t* get_steps() { return steps; }
void steps_to_mpos(float*, steps_t*) {}
bool state_is(State state) { return state == State::CheckMode; }

Coordinates* coords[CoordIndex::End];
void Coordinates::set(float* value) { memcpy(_currentValue, value, sizeof _currentValue); }

/* What there is nothing of. */
bool Job::active() { return false; }
Channel* Job::channel() { return nullptr; }
JobSource* Job::source() { return nullptr; }
bool Job::get_param(const std::string&, float&) { return false; }
bool Job::set_param(const std::string&, float) { return false; }
bool Job::param_exists(const std::string&) { return false; }
bool atMsgLevel(MsgLevel) { return false; }
LogStream::LogStream(MsgLevel level, const char*) : _channel(*reinterpret_cast<Channel*>(none[7])) {}
LogStream::LogStream(Channel& channel, MsgLevel level, const char*) : _channel(channel) {}
size_t LogStream::write(uint8_t) { return 1; }
LogStream::~LogStream() {}
void AllChannels::notifyNgc(CoordIndex) {}
void AllChannels::notifyOvr() {}
void AllChannels::notifyWco() {}
void CoolantControl::off() {}
void CoolantControl::set_state(CoolantState) {}
Error jog_execute(plan_line_data_t*, parser_block_t*, bool*) { return Error::Ok; }
void protocol_exec_rt_system() {}
void protocol_execute_realtime() {}
void protocol_buffer_synchronize() {}
void protocol_send_event(const Event*, void*) {}
const NoArgEvent feedHoldEvent(nullptr);
void report_feedback_message(Message) {}
Counter report_ovr_counter;
void send_alarm(ExecAlarm) {}
const char* grbl_version = "";
const char* errorString(Error) { return ""; }
TickType_t xTaskGetTickCount() { return 0; }
void vTaskDelay(const TickType_t) {}
Pin::~Pin() {}
std::runtime_error AssertionFailed::create(const char* message, ...) { return std::runtime_error(message); }

namespace Configuration {
    GCodeParam::GCodeParam(std::string_view, float& value, bool get) : _iovalue(value), _get(get) {}
    GCodeParam::~GCodeParam() {}
}

namespace Machine {
    bool UserOutputs::setAnalogPercent(size_t, float) { return true; }
    bool UserOutputs::setDigital(size_t, bool) { return true; }
    axis_t Axes::_numberAxis = static_cast<axis_t>(3);
    Axis* Axes::_axis[MAX_N_AXIS];
}

namespace Spindles {
    void Spindle::switchSpindle(uint32_t, SpindleList, Spindle*&, bool&, bool&) {}
    bool Spindle::isRateAdjusted() { return false; }
    bool Spindle::tool_change(uint32_t, bool, bool) { return true; }
    void Spindle::init_atc() {}
    void Spindle::afterParse() {}

    struct Silent : Spindle {
        Silent() : Spindle("") {}
        void init() override {}
        void setState(SpindleState, uint32_t) override {}
        void config_message() override {}
        void setSpeedfromISR(uint32_t) override {}
    };
}

Spindles::Spindle* spindle;
Machine::MachineConfig* config;

static void start() {
    static Spindles::Silent silent;
    spindle = &silent;
    config = reinterpret_cast<Machine::MachineConfig*>(none[0]);
    config->_coolant = reinterpret_cast<CoolantControl*>(none[1]);
    config->_probe = reinterpret_cast<Probe*>(none[2]);
    config->_start = reinterpret_cast<Machine::Start*>(none[3]);
    config->_userOutputs = reinterpret_cast<Machine::UserOutputs*>(none[4]);
    float zeros[MAX_N_AXIS] = {};
    for (auto at = CoordIndex::Begin; at < CoordIndex::End; ++at) {
        coords[at] = new Coordinates("");
        coords[at]->set(zeros);
    }
    gc_init();
}

int main() {
    static char text[4096];
    int line = 0;

    start();
    while (fgets(text, sizeof text, stdin)) {
        // As execute_line (ProcessSettings.cpp): blanks in front, and the commands of the control.
        text[strcspn(text, "\n")] = '\0';
        char* block = text + strspn(text, " \t\r\v\f");
        int error = 0;
        if (*block)
            error = *block == '$' || *block == '[' ? -1 : static_cast<int>(gc_execute_line(block));
        printf("[%d,%d,%d,%d,%d,%d,%.9g", ++line, error, motions, rapids,
               gc_state.modal.distance == Distance::Incremental, gc_state.modal.units == Units::Inches, gc_state.feed_rate);
        get_wco();
        for (int axis = 0; axis < Machine::Axes::_numberAxis; axis++)
            printf(",%.9g,%.9g", gc_state.position[axis], offset[axis]);
        puts("]");
        motions = rapids = 0;
    }
}
