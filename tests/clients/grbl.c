/* grbl's own interpreter, without a machine: what each line of a program does.

   Reads lines from standard input and prints one line of JSON for each:

       [line, error, motions, rapids, G91, inch, F, position, offset, position, offset, ...]

   F in mm/min; positions in machine coordinates and offsets of each axis in mm. Its own protocol.c takes
   the lines apart; what it would ask of a machine is here, and moves nothing. Built by firmware.py with
   the sources of a checkout. */

#include <stdio.h>

#include "grbl.h"

system_t sys;
int32_t sys_position[N_AXIS], sys_probe_position[N_AXIS];
volatile uint8_t sys_probe_state, sys_rt_exec_state, sys_rt_exec_alarm;
volatile uint8_t sys_rt_exec_motion_override, sys_rt_exec_accessory_override;

static int line, motions, rapids;

void mc_line(float *target, plan_line_data_t *data)
{
    motions++;
    rapids += (data->condition & PL_COND_FLAG_RAPID_MOTION) != 0;
}

void mc_arc(float *target, plan_line_data_t *data, float *position, float *offset, float radius,
            uint8_t axis_0, uint8_t axis_1, uint8_t axis_linear, uint8_t clockwise)
{
    motions++;
}

uint8_t mc_probe_cycle(float *target, plan_line_data_t *data, uint8_t flags)
{
    motions++;
    return GC_PROBE_CHECK_MODE;
}

/* One of these for each line. */
void report_status_message(uint8_t error)
{
    printf("[%d,%d,%d,%d,%d,%d,%.9g", ++line, error, motions, rapids,
           gc_state.modal.distance == DISTANCE_MODE_INCREMENTAL, gc_state.modal.units == UNITS_MODE_INCHES,
           gc_state.feed_rate);
    for(int axis = 0; axis < N_AXIS; axis++)
        printf(",%.9g,%.9g", gc_state.position[axis],
               gc_state.coord_system[axis] + gc_state.coord_offset[axis] +
               (axis == TOOL_LENGTH_OFFSET_AXIS ? gc_state.tool_length_offset : 0.0f));
    puts("]");
    motions = rapids = 0;
}

uint8_t serial_read(void)
{
    int c = getchar();
    sys.abort |= c == EOF;
    return c == EOF ? SERIAL_NO_DATA : c;
}

uint8_t system_execute_line(char *text)
{
    return STATUS_INVALID_STATEMENT;
}

static unsigned char memory[4096];

unsigned char eeprom_get_char(unsigned int at)
{
    return memory[at];
}

void eeprom_put_char(unsigned int at, unsigned char value)
{
    memory[at] = value;
}

void memcpy_to_eeprom_with_checksum(unsigned int at, char *from, unsigned int size)
{
    memcpy(memory + at, from, size);
}

int memcpy_from_eeprom_with_checksum(char *to, unsigned int at, unsigned int size)
{
    memcpy(to, memory + at, size);
    return 1;
}

/* What there is nothing of. */
#define NOTHING(type, name, ...) type name(__VA_ARGS__) { return (type)0; }
NOTHING(uint8_t, coolant_get_state, void)
NOTHING(uint8_t, jog_execute, plan_line_data_t *data, parser_block_t *block)
NOTHING(uint8_t, limits_get_state, void)
NOTHING(uint8_t, system_check_safety_door_ajar, void)
NOTHING(plan_block_t *, plan_get_current_block, void)
#define SILENT(name, ...) void name(__VA_ARGS__) {}
SILENT(coolant_set_state, uint8_t mode)
SILENT(coolant_sync, uint8_t mode)
SILENT(limits_init, void)
SILENT(mc_dwell, float seconds)
SILENT(plan_cycle_reinitialize, void)
SILENT(plan_reset, void)
SILENT(plan_sync_position, void)
SILENT(plan_update_velocity_profile_parameters, void)
SILENT(probe_configure_invert_mask, uint8_t away)
SILENT(report_alarm_message, uint8_t alarm)
SILENT(report_feedback_message, uint8_t message)
SILENT(report_grbl_settings, void)
SILENT(report_realtime_status, void)
SILENT(spindle_init, void)
SILENT(spindle_set_state, uint8_t state, float rpm)
SILENT(spindle_sync, uint8_t state, float rpm)
SILENT(st_generate_step_dir_invert_masks, void)
SILENT(st_go_idle, void)
SILENT(st_prep_buffer, void)
SILENT(st_reset, void)
SILENT(st_update_plan_block_parameters, void)
SILENT(st_wake_up, void)
SILENT(system_clear_exec_accessory_overrides, void)
SILENT(system_clear_exec_alarm, void)
SILENT(system_clear_exec_motion_overrides, void)
SILENT(system_clear_exec_state_flag, uint8_t mask)
SILENT(system_convert_array_steps_to_mpos, float *position, int32_t *steps)
SILENT(system_execute_startup, char *text)
SILENT(system_flag_wco_change, void)
SILENT(system_set_exec_accessory_override_flag, uint8_t mask)
SILENT(system_set_exec_state_flag, uint8_t mask)

int main(void)
{
    settings_restore(SETTINGS_RESTORE_ALL);
    settings_init();
    gc_init();
    protocol_main_loop();
    return 0;
}
