/* grblHAL's own interpreter, without a machine: what each line of a program does.

   Reads blocks from standard input and prints one line of JSON for each:

       [line, error, motions, rapids, G91, inch, F, position, offset, position, offset, ...]

   F in mm/min; positions in machine coordinates and offsets of each axis in mm. The program is
   checked ($C), so that motions end when they begin. Blanks in front of a line and control characters
   are dropped as protocol.c drops them. Built by firmware.py with the sources of a checkout. */

#include <stdio.h>
#include <string.h>

#include "eeprom.h"
#include "grbl_eeprom_extensions.h"
#include "grbl/gcode.h"
#include "grbl/hal.h"
#include "grbl/motion_control.h"
#include "grbl/nvs_buffer.h"
#include "grbl/protocol.h"
#include "grbl/report.h"
#include "grbl/state_machine.h"

static int motions, rapids;

/* In the place of mc_line and mc_arc (by the linker's --wrap): they count. */
status_code_t __wrap_mc_line (float *target, plan_line_data_t *data)
{
    motions++;
    rapids += data->condition.rapid_motion;
    return Status_Handled;
}

void __wrap_mc_arc (float *target, plan_line_data_t *data, float *position, float *offset, float radius,
                    plane_t plane, int32_t turns)
{
    motions++;
}

static int32_t read_nothing (void)
{
    return SERIAL_NO_DATA;
}

static void write_nothing (const char *text)
{
}

static bool nobody_listens (void)
{
    return false;
}

static atc_status_t no_changer (void)
{
    return ATC_None;
}

static void start (void)
{
    set_eeprom_name("EEPROM.DAT");
    memset(&grbl, 0, sizeof grbl);
    grbl.on_execute_realtime = protocol_execute_noop;
    grbl.enqueue_gcode = protocol_enqueue_gcode;
    grbl.on_get_errors = errors_get_details;
    memset(&hal, 0, sizeof hal);
    hal.version = HAL_VERSION;
    hal.driver_reset = hal.irq_enable = hal.irq_disable = dummy_handler;
    hal.nvs.size = GRBL_NVS_SIZE;
    hal.nvs.type = NVS_EEPROM;
    hal.nvs.get_byte = eeprom_get_char;
    hal.nvs.put_byte = eeprom_put_char;
    hal.nvs.memcpy_to_nvs = memcpy_to_eeprom;
    hal.nvs.memcpy_from_nvs = memcpy_from_eeprom;
    driver_init();
    hal.tool.atc_get_state = no_changer;
    memset(&sys, 0, sizeof sys);
    sys.cold_start = true;
    nvs_buffer_alloc();
    nvs_buffer_init();
    settings_init();
    report_init_fns();
    hal.stream.read = read_nothing;
    hal.stream.write = hal.stream.write_all = write_nothing;
    hal.stream.is_connected = nobody_listens;
    state_set(STATE_CHECK_MODE);
    gc_init(false);
}

int main (void)
{
    static char text[4096], block[4096];
    int line = 0;

    start();
    while(fgets(text, sizeof text, stdin)) {
        int n = 0;
        status_code_t error = Status_OK;
        for(char *at = text; *at; at++) {
            if((unsigned char)*at > (n ? ' ' - 1 : ' '))
                block[n++] = *at;
        }
        block[n] = '\0';
        if(n >= LINE_BUFFER_SIZE)
            error = Status_Overflow;
        else if(n)
            error = block[0] == '$' || block[0] == '[' ? Status_InvalidStatement : gc_execute_block(block);
        plan_reset();
        printf("[%d,%d,%d,%d,%d,%d,%.9g", ++line, error, motions, rapids,
               gc_state.modal.distance_incremental, gc_state.modal.units_imperial, gc_state.feed_rate);
        for(int axis = 0; axis < N_AXIS; axis++)
            printf(",%.9g,%.9g", gc_state.position[axis], gc_get_offset(axis, false));
        puts("]");
        motions = rapids = 0;
        if(sys.abort)
            break;
    }
    return 0;
}
