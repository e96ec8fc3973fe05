/* Marlin's own interpreter, without a machine: what each line of a program does there.

   Reads lines from standard input and prints one line of JSON for each:

       [line, error, motions, rapids, G91, inch, F, position, offset, position, offset, ...]

   F in mm/min; positions in machine coordinates and offsets of each axis in mm. The argument says how
   a line comes: "file" as from a card, "bare" through the serial port as it is, "sent" as senders do,
   without its comments, with a number and a checksum. What Marlin would ask of a machine is here, and
   moves nothing. Built by firmware.py with the sources of a checkout, for Marlin's own Linux. */

#include <cstdio>
#include <string>
#include <unistd.h>

#include "src/inc/MarlinConfig.h"
#include "src/MarlinCore.h"
#include "src/gcode/gcode.h"
#include "src/gcode/queue.cpp"
#include "src/module/motion.h"
#include "src/module/planner.h"

static int motions;
static bool unknown;

extern "C" {

bool __wrap__ZN7Planner11buffer_lineERK7XYZEvalIfEfhRK12PlannerHints(
    const xyze_pos_t &place, const_feedRate_t feed, const uint8_t tool, const PlannerHints &hints)
{
    motions++;
    return true;
}

void __wrap__Z8homeaxis8AxisEnum(const AxisEnum axis)
{
    set_axis_is_at_home(axis);
    current_position[axis] = 7.0f + axis;
}

void __wrap__ZN11GCodeParser23unknown_command_warningEv()
{
    unknown = true;
}

void __wrap__ZN8Endstops20validate_homing_moveEv() {}
void __wrap__ZN7Planner11synchronizeEv() {}
void __wrap__Z4idleb(const bool) {}
void __wrap__Z10safe_delayj(const millis_t) {}

}

static void take_file(const std::string &text)
{
    char command[MAX_CMD_SIZE];
    uint8_t state = PS_NORMAL;
    int length = 0;
    for(char each : text)
        process_stream_char(each, state, command, length);
    if(!process_line_done(state, command, length))
        queue.ring_buffer.enqueue(command, true);
}

static void take_serial(const std::string &text)
{
    for(char each : text + '\n') {
        usb_serial.receive_buffer.write(each);
        queue.get_available_commands();
    }
}

static std::string sent(std::string text)
{
    static int number;
    #if ENABLED(PAREN_COMMENTS)
        for(size_t begin; (begin = text.find('(')) < text.find(';');) {
            const size_t end = text.find(')', begin);
            text.erase(begin, end == std::string::npos ? end : end + 1 - begin);
        }
    #endif
    text.erase(std::min(text.find(';'), text.size()));
    text.erase(text.find_last_not_of(' ') + 1);
    if(text.empty())
        return text;
    text = "N" + std::to_string(++number) + " " + text;
    uint8_t checksum = 0;
    for(char each : text)
        checksum ^= (uint8_t)each;
    return text + '*' + std::to_string(checksum);
}

int main(int, char **arguments)
{
    const std::string way = arguments[1];
    std::string text;
    int line = 0, c;
    Clock::setFrequency(F_CPU);
    Clock::setTimeMultiplier(1e4);
    usb_serial.host_connected = false;
    feedrate_mm_s = MMM_TO_MMS(3000);
    marlin_state = MF_RUNNING;
    while((c = getchar()) != EOF) {
        if(c != '\n') {
            text += (char)c;
            continue;
        }
        if(way == "file")
            take_file(text);
        else
            take_serial(way == "sent" ? sent(text) : text);
        text.clear();
        motions = 0;
        unknown = false;
        while(queue.ring_buffer.occupied())
            queue.advance();
        printf("[%d,%d,%d,%d,%d,%d,%.9g", ++line, unknown, motions, motions, gcode.axis_is_relative(X_AXIS),
               GCodeParser::using_inch_units(), MMS_TO_MMM(feedrate_mm_s));
        LOOP_NUM_AXES(axis)
            printf(",%.9g,%.9g", current_position[axis], -workspace_offset[axis]);
        puts("]");
    }
    fflush(stdout);
    _exit(0);
}
